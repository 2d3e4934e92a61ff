"""A zenoh router on loopback: router.py LISTEN [CONNECT...]; ends with its standard input."""

import json
import sys

import zenoh

config = zenoh.Config()
config.insert_json5("mode", json.dumps("router"))
config.insert_json5("listen/endpoints", json.dumps([sys.argv[1]]))
config.insert_json5("connect/endpoints", json.dumps(sys.argv[2:]))
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config):
    print("ready", flush=True)
    sys.stdin.read()

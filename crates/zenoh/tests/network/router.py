"""A zenoh router on loopback: router.py LISTEN [--settings FILE] [CONNECT...]; ends with its standard input."""

import json
import sys

import zenoh

listen, *connect = sys.argv[1:]
config = zenoh.Config()
if connect[:1] == ["--settings"]:
    config = zenoh.Config.from_file(connect[1])
    connect = connect[2:]
config.insert_json5("mode", json.dumps("router"))
config.insert_json5("listen/endpoints", json.dumps([listen]))
config.insert_json5("connect/endpoints", json.dumps(connect))
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config):
    print("ready", flush=True)
    sys.stdin.read()

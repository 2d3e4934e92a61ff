"""A zenoh router on loopback, with flags of zenohd. It prints `ready`, and ends with its standard input."""

import argparse
import json
import sys

import zenoh

parser = argparse.ArgumentParser()
parser.add_argument("--listen", required=True)
parser.add_argument("--connect", action="append", default=[])
parser.add_argument("--config")
parser.add_argument("--no-multicast-scouting", action="store_true")
flags = parser.parse_args()
config = zenoh.Config.from_file(flags.config) if flags.config else zenoh.Config()
config.insert_json5("mode", json.dumps("router"))
config.insert_json5("listen/endpoints", json.dumps([flags.listen]))
config.insert_json5("connect/endpoints", json.dumps(flags.connect))
# As in zenohd.
config.insert_json5("adminspace/enabled", "true")
if flags.no_multicast_scouting:
    config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config):
    print("ready", flush=True)
    sys.stdin.read()

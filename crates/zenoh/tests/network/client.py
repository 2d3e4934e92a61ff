"""A zenoh program that knows nothing of JAUS.

client.py ENDPOINT get SELECTOR          prints the values, one a line
client.py ENDPOINT subscribe KEY COUNT   prints so many values, and `subscribed` before them
client.py ENDPOINT tokens KEY            prints the keys of liveliness tokens
client.py ENDPOINT put KEY HEX [TOKEN]   publishes octets, and declares a token before
client.py ENDPOINT token KEY             declares a token, prints the id of its session, and stays
"""

import json
import sys
import time

import zenoh


def main(endpoint, action, key, argument=None, token=None):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps("client"))
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        if action == "get":
            for reply in session.get(key, timeout=20):
                value = reply.ok or reply.err
                prefix = "" if reply.ok else "error: "
                print(prefix + value.payload.to_string(), flush=True)
        elif action == "subscribe":
            samples = session.declare_subscriber(key)
            print("subscribed", flush=True)
            for _ in range(int(argument)):
                print(samples.recv().payload.to_string(), flush=True)
        elif action == "tokens":
            for reply in session.liveliness().get(key, timeout=20):
                if reply.ok:
                    print(reply.ok.key_expr, flush=True)
        elif action == "token":
            declared = session.liveliness().declare_token(key)
            print(session.zid(), flush=True)
            time.sleep(120)
            declared.undeclare()
        elif action == "put":
            declared = token and session.liveliness().declare_token(token)
            session.put(key, bytes.fromhex(argument))
            time.sleep(0.2)
            del declared


main(*sys.argv[1:])

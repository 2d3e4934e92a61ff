# docs/hardening.md: who opens plain JUDP to a network without grants says that every host there may command.
ip link add eth0 type veth peer name eth1
ip addr add 10.9.9.1/24 dev eth0
ip link set eth0 up
ip link set eth1 up
warnings() { # FLAGS
    jaus node --id 101.1.1 --for 1s "$@" 2>"$work/node.log" >/dev/null
    grep -c "MAY COMMAND" "$work/node.log" || true
}
[ "$(warnings --interface eth0)" = 1 ] || fail "no warning, or several"
grep -q "plain JAUS on eth0: ANY HOST" "$work/node.log" || fail "the warning does not name the network"
[ "$(warnings)" = 1 ] || fail "no warning with the default settings"
[ "$(warnings --json)" = 1 ] || fail "no warning with --json"
[ "$(warnings --loopback)" = 0 ] || fail "a warning on loopback"
[ "$(warnings --interface eth0 --grant '65535.255.255 observe')" = 0 ] || fail "a warning with grants"

# A serial line, and a connection to another host.
python3 -c 'import os, time; line, end = os.openpty(); print(os.ttyname(end), flush=True); time.sleep(60)' >"$work/line" &
until [ -s "$work/line" ]; do sleep 0.1; done
line=$(cat "$work/line")
printf '[[serial]]\ndevice = "%s"\n' "$line" >"$work/serial.toml"
[ "$(warnings --loopback --config "$work/serial.toml")" = 1 ] || fail "no warning with a serial line"
grep -q "plain JAUS on $line: ANY HOST" "$work/node.log" || fail "the warning does not name the serial line"
printf '[tcp]\nconnect = ["%s"]\n' 10.9.9.2 >"$work/tcp.toml"
[ "$(warnings --loopback --config "$work/tcp.toml")" = 1 ] || fail "no warning with a connection"
printf '[tcp]\nconnect = ["%s"]\n' 127.0.0.1 >"$work/tcp.toml"
[ "$(warnings --loopback --config "$work/tcp.toml")" = 0 ] || fail "a warning with a connection on this host"

# A service as it is installed, which may also start before the network.
ip link del eth0
start jaus@communicator
await jaus@communicator "interfaces that come up: ANY HOST"
[ "$(grep -c "MAY COMMAND" "$work/jaus@communicator.log")" = 1 ] || fail "several warnings"

# docs/raspberry-pi.md, "One board": the parts of a vehicle, each as its user, on the node of the communicator; and
# the operator's station.
enabled=$(block raspberry-pi.md "## 3. One board" 1 | grep -o 'jaus@[a-z][a-z-]*')
[ "$(echo "$enabled" | wc -l)" -gt 7 ] || fail "the guide enables $enabled"
for unit in $enabled; do start "$unit"; done
for unit in $enabled; do
    [ "$unit" = jaus@communicator ] || await "$unit" "attached to the node"
done
jaus query 101.1.36 QueryIdentification '{"QueryType":4}' --attach=/run/jaus/node.sock >"$work/answer" || fail "no answer of the planner"
# Who takes over a sensor drives nothing, and stays a sensor.
as_sensor() { setpriv --reuid jaus-imu-sensor --regid jaus --clear-groups jaus "$@" --attach=/run/jaus/node.sock; }
as_sensor query 101.1.36 QueryIdentification '{"QueryType":4}' >"$work/answer" || fail "a sensor gets no answer of the planner"
if as_sensor control 101.1.36 resume >"$work/taken.log" 2>&1; then fail "a sensor takes control"; fi
setpriv --reuid nobody --regid jaus --clear-groups jaus discover --attach=/run/jaus/node.sock >"$work/nobody.log" 2>&1 || true
grep -q 'local_users' "$work/nobody.log" || fail "a user without an entry is not told"
start jaus@ocu
await jaus@ocu "http://"
token=/var/lib/jaus/ocu/page.token
[ "$(stat -c %U:%a $token)" = jaus-ocu:600 ] || fail "the page's token: $(stat -c %U:%a $token)"
for unit in $enabled jaus@ocu; do
    [ "$(ps -o user:40= -p "${processes[$unit]}")" = "jaus-${unit#*@}" ] || fail "$unit is of another user"
done

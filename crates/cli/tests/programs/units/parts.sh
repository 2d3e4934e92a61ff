# docs/raspberry-pi.md, "One board": the parts of a vehicle, each as its user, on the node of the communicator; and
# the operator's station.
enabled=$(block raspberry-pi.md "## 3. One board" 1 | grep -o 'jaus@[a-z][a-z-]*')
[ "$(echo "$enabled" | wc -l)" -gt 7 ] || fail "the guide enables $enabled"
for unit in $enabled; do start "$unit"; done
for unit in $enabled; do
    [ "$unit" = jaus@communicator ] || await "$unit" "attached to the node"
done
jaus query 101.1.36 QueryIdentification '{"QueryType":4}' --attach=/run/jaus/node.sock >"$work/answer" || fail "no answer of the planner"
start jaus@ocu
await jaus@ocu "http://"
token=/var/lib/jaus/ocu/page.token
[ "$(stat -c %U:%a $token)" = jaus-ocu:600 ] || fail "the page's token: $(stat -c %U:%a $token)"
for unit in $enabled jaus@ocu; do
    [ "$(ps -o user:40= -p "${processes[$unit]}")" = "jaus-${unit#*@}" ] || fail "$unit is of another user"
done

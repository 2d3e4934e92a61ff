# docs/secure-links.md, "As a service".
export HOME=$work/operator
mkdir "$HOME"
operator=$(jaus keys new)
guide=secure-links.md heading="## As a service"
. <(block $guide "$heading" 1 | sed "s|OPERATORS_KEY|$operator|")
block $guide "$heading" 2 >>/etc/jaus/communicator.toml
. <(block $guide "$heading" 3)
await jaus@communicator "components of this host may attach"

rover=$(jaus keys show --key /etc/credstore/jaus-communicator.node.key)
jaus keys trust rover "$rover" 101.255.255
ask() { # ID FLAGS
    for _ in $(seq 20); do
        ! jaus query "$1" QueryIdentification '{"QueryType":4}' "${@:2}" >"$work/answer" || return 0
    done
    fail "no answer of $1"
}
ask 101.1.35 --id 60.1.1 --secure-peer 127.0.0.1
log=/var/log/jaus/communicator/audit.jsonl
[ "$(stat -c %U:%a "$log")" = jaus-communicator:600 ] || fail "$(stat -c %U:%a "$log") owns the audit log"
grep -q '"who":"operator","what":"connect"' "$log" || fail "nothing in the audit log"

# Another part attaches to the node, and has not its key.
start jaus@planner
await jaus@planner "attached to the node"
ask 101.1.36 --id 60.1.1 --secure-peer 127.0.0.1
ask 101.1.36 --attach=/run/jaus/node.sock
as() { setpriv --reuid="$1" --regid=jaus --clear-groups "${@:2}"; }
key=/run/credentials/jaus@communicator.service/node.key
as jaus-communicator cat $key >/dev/null || fail "the service cannot read its key"
! as jaus-planner cat $key 2>/dev/null || fail "the planner can read the communicator's key"
! as jaus-planner touch /run/jaus/x 2>/dev/null || fail "the planner can replace the socket"
! setpriv --reuid=nobody --regid=nogroup --clear-groups jaus query 101.1.36 QueryIdentification --attach=/run/jaus/node.sock 2>/dev/null ||
    fail "a user outside of the group attaches"

jaus keys revoke operator --trusted-keys /etc/jaus/trusted_keys 2>&1 | tee "$work/revoked.log"
grep -q "have taken the change" "$work/revoked.log" || fail "the service has not taken the change"

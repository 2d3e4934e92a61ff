# docs/viewers.md, "The black box".
ip link add eth0 type veth peer name eth1
ip addr add 10.9.9.1/24 dev eth0
ip link set eth0 up
ip link set eth1 up
block viewers.md "## The black box" 2 >"$work/recipe"
. <(sed -n 1p "$work/recipe")
await jaus-black-box@eth0 "kill -USR1"
jaus node --id 101.1.1 --interface eth0 --for 2s >"$work/node.log" 2>&1
. <(sed -n 2p "$work/recipe")
await jaus-black-box@eth0 "black-box-000001"
sudo() { ls -l /var/log/jaus/black-box-eth0 | tee "$work/list"; }
. <(sed -n 3p "$work/recipe")
grep -q '^-rw-r----- 1 jaus-record jaus-record .* black-box-000001-.*\.pcapng$' "$work/list" || fail "no file"
for _ in $(seq 100); do
    file=$(echo /var/log/jaus/black-box-eth0/*.pcapng)
    ! jaus decode "$file" 2>/dev/null | grep -q 101.1.1 || exit 0
    sleep 0.1
done
fail "nothing of 101.1.1 in $file"

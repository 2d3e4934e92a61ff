# A host without systemd, on which recipes of the guides are followed as they are written: with the users of
# sysusers.d, and services in a view of the file system like the one that their units describe.
#
#     unshare --mount --net bash host.sh PROGRAMS PROJECT RECIPE
#
# RECIPE is sourced at the end. It has `block`, `start`, `await` and the shims `sudo` and `systemctl`.
set -euo pipefail
programs=$1 project=$2 recipe=$3
units=$project/packaging/systemd
shopt -s nullglob

mount --make-rprivate /
ip link set lo up
for folder in /var/log /var/lib /run; do mount -t tmpfs -o mode=755 tmpfs "$folder"; done
work=/run/work
mkdir "$work"
trap 'kill $(jobs -p) 2>/dev/null || true' EXIT
cp -a /etc "$work/etc"
mount --bind "$work/etc" /etc
# Users of services cannot reach them where they were built.
mkdir /run/programs
mount --bind "$programs" /run/programs
export PATH=/run/programs:$PATH
unset JAUS_LOG

# What the package installs.
mkdir -p /etc/jaus
cp "$project"/packaging/etc/*.toml /etc/jaus/
systemd-sysusers "$project/packaging/sysusers.d/jaus.conf"
install -d -o jaus -g jaus -m 0750 /var/lib/jaus

fail() {
    echo "FAILED: $*"
    tail -n 20 "$work"/*.log
    exit 1
}

# The NUMBERth code block below a heading of a guide.
block() { # FILE HEADING NUMBER
    awk -v heading="$2" -v number="$3" '
        $0 == heading { here = 1 }
        here && /^```/ { inside = !inside; count += inside; next }
        here && inside && count == number' "$project/docs/$1"
}

# The values of a key in a unit and its drop-ins.
setting() { # UNIT KEY
    cat "$units/${1%@*}@.service" "$units/$1.service.d/"*.conf 2>/dev/null |
        sed -n "s/^$2=//p" | sed "s/%i/${1#*@}/g; s|%S|/var/lib|g"
}

declare -A processes
start() { # UNIT
    local unit=$1 user group kind name folder source writable=() variables=()
    user=$(setting "$unit" User) group=$(setting "$unit" Group)
    for kind in State:/var/lib Logs:/var/log Runtime:/run; do
        name=$(setting "$unit" "${kind%:*}Directory")
        [ -n "$name" ] || continue
        folder=${kind#*:}/$name
        mkdir -p "$folder"
        chown "$user:$group" "$folder"
        chmod "$(setting "$unit" "${kind%:*}DirectoryMode")" "$folder"
        writable+=("$folder")
        variables+=("$(tr a-z A-Z <<<"${kind%:*}")_DIRECTORY=$folder")
    done
    local credentials=/run/credentials/$unit.service
    mkdir -p "$credentials"
    while IFS=: read -r name source; do
        [ ! -e "/etc/credstore/$source" ] ||
            install -m 400 -o "$user" "/etc/credstore/$source" "$credentials/$name"
    done < <(setting "$unit" LoadCredential)
    chown "$user" "$credentials"
    chmod 500 "$credentials"
    local capabilities=-all
    for name in $(setting "$unit" CapabilityBoundingSet); do
        name=${name#CAP_}
        capabilities+=,+${name,,}
    done
    local command directory
    command=$(setting "$unit" ExecStart | sed 's|^/usr/bin/|/run/programs/|')
    directory=$(setting "$unit" WorkingDirectory)
    unshare --mount bash -euc '
        # ProtectSystem=strict, PrivateTmp=yes.
        for folder in / /etc /var/log /var/lib /run /run/programs; do mount -o remount,bind,ro "$folder"; done
        mount -t tmpfs tmpfs /tmp
        user=$1 group=$2 capabilities=$3 variables=$4 directory=$5 command=$6
        shift 6
        for folder in "$@"; do
            mount --bind "$folder" "$folder"
            mount -o remount,bind,rw "$folder"
        done
        cd "${directory:-/}"
        exec env -i PATH=/usr/bin:/bin $variables \
            setpriv --reuid="$user" --regid="$group" --clear-groups --no-new-privs --bounding-set="$capabilities" \
            --inh-caps="$capabilities" --ambient-caps="$capabilities" $command' \
        - "$user" "$group" "$capabilities" "CREDENTIALS_DIRECTORY=$credentials ${variables[*]}" \
        "$directory" "$command" "${writable[@]}" \
        >"$work/$unit.log" 2>&1 &
    processes[$unit]=$!
}

# Waits until the log of a unit has a text.
await() { # UNIT TEXT
    for _ in $(seq 600); do
        ! grep -q "$2" "$work/$1.log" || return 0
        kill -0 "${processes[$1]}" 2>/dev/null || fail "$1 has ended"
        sleep 0.1
    done
    fail "no \"$2\" in the log of $1"
}

sudo() { "$@"; }
systemctl() {
    case "$*" in
    "restart "* | "enable --now "*) start "${@: -1}" ;;
    "kill -s "*) kill -s "$3" "${processes[$4]}" ;;
    *) fail "systemctl $*" ;;
    esac
}

. "$recipe"

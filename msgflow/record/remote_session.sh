# Records on another machine, or in a container, with what is there: LTTng and a POSIX shell.
#
# Lines of stdin: name of the session; size and number of sub-buffers; events of the kernel, or -;
# a line for each event, and behind a space what it leaves out; "start". Then it prints "started".
# Behind a line "stop" it prints a tar archive of the recording. Wherever stdin ends, it ends all:
# no session stays when the other side goes away.
#
# There is no single quote in here, and no backslash: any POSIX login shell passes it on as one word.
set -u
fail() {
    echo "Error: $1" >&2
    exit 1
}
end() {
    trap "" HUP INT TERM PIPE
    [ -z "$created" ] || lttng --no-sessiond destroy "$name" > /dev/null 2>&1
    [ -z "$daemon" ] || kill "$daemon"
    rm -rf "$place"
}
free_kilobytes() {
    df -Pk "$place" | tail -n 1 | {
        read -r _ _ _ free _
        echo "$free"
    }
}
answers() {
    lttng --no-sessiond list < /dev/null > /dev/null 2>&1
}
to_session() {
    command=$1
    domain=$2
    shift 2
    lttng --no-sessiond "$command" "$domain" --session="$name" "$@" < /dev/null >&2
}
channel() {
    to_session enable-channel "$1" --subbuf-size="$size" --num-subbuf="$number" ros2
}

command -v lttng > /dev/null && command -v lttng-sessiond > /dev/null || fail "lttng is not installed"
daemon="" created=""
place=$(mktemp -d "${TMPDIR:-/tmp}/msgflow-record.XXXXXX") || fail "no directory for the recording"
trap end EXIT
trap "exit 1" HUP INT TERM PIPE
[ "$(free_kilobytes)" -ge 100000 ] || fail "the disk of ${TMPDIR:-/tmp} is full"

read -r name && read -r size number && read -r kernel || exit 1
if ! answers; then
    quiet=--no-kernel
    [ "$kernel" = - ] || quiet=
    lttng-sessiond $quiet < /dev/null > /dev/null 2>&1 &
    daemon=$!
    tries=0
    until answers; do
        tries=$((tries + 1))
        [ "$tries" -le 100 ] && kill -0 "$daemon" 2> /dev/null || fail "lttng-sessiond does not start"
        sleep 0.1
    done
    # Processes that run already connect to it meanwhile.
    sleep 1
fi
lttng --no-sessiond create "$name" --output="$place/trace" >&2 || exit 1
created=yes
channel --userspace || exit 1
while read -r event without && [ "$event" != start ]; do
    to_session enable-event --userspace --channel=ros2 ${without:+--exclude="$without"} "$event" || exit 1
done
[ "${event:-}" = start ] || exit 1
to_session add-context --userspace --channel=ros2 --type=vpid --type=vtid --type=procname || exit 1
if [ "$kernel" != - ]; then
    channel --kernel && to_session enable-event --kernel --channel=ros2 "$kernel" ||
        echo "note: its kernel cannot be traced" >&2
fi
lttng --no-sessiond start "$name" >&2 || exit 1
echo started

read -r word && [ "$word" = stop ] || exit 1
lttng --no-sessiond destroy "$name" >&2 || exit 1
created=""
[ "$(free_kilobytes)" -ge 1000 ] || echo "note: its disk is full: the end of its recording is lost" >&2
tar -C "$place/trace" -cf - .

#!/bin/sh
# A run over a cable between two machines, as network namespaces of this one (needs root):
#
#   sh docs/network/cable.sh SECONDS [OPTIONS]
#
# After four seconds the cable is out for SECONDS. OPTIONS are for both parts.
set -eu
out=$1
shift
robot=ratelab-robot desk=ratelab-desk policy=

end() {
    [ -z "$policy" ] || kill -INT "$policy" 2>/dev/null || true
    wait
    ip netns del "$robot" 2>/dev/null || true
    ip netns del "$desk" 2>/dev/null || true
}
trap end EXIT

ip netns add "$robot"
ip netns add "$desk"
ip link add cable netns "$robot" type veth peer name cable netns "$desk"
ip -n "$robot" addr add 10.77.0.1/24 dev cable
ip -n "$desk" addr add 10.77.0.2/24 dev cable
ip -n "$robot" link set cable up
ip -n "$desk" link set cable up

address=tcp/10.77.0.1:7447
ip netns exec "$desk" ratelab node policy --connect "$address" "$@" &
policy=$!
ip netns exec "$robot" ratelab node plant --listen "$address" --insecure --duration-s 10 "$@" &
plant=$!
sleep 4
ip -n "$robot" link set cable down
sleep "$out"
ip -n "$robot" link set cable up
wait "$plant"

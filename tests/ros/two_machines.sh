#!/bin/sh
# Two networks joined by a cable, as two machines are; a stranger on the second one calls to the plant on the first.
#   two_machines.sh DISCOVERY_RANGE_OF_THE_PLANT PYTHON MODEL STRANGER SECONDS_ABROAD    # within: unshare --net
set -eu
plant=
unshare --net sleep 600 &
other=$!
trap 'kill -KILL $plant $other' EXIT
ip link set lo up
until [ "$(readlink "/proc/$other/ns/net")" != "$(readlink /proc/self/ns/net)" ]; do sleep 0.02; done
ip link add here type veth peer name there netns "$other" || exit 3
ip address add 10.213.7.1/24 dev here && ip link set here up && ip route add 224.0.0.0/4 dev here
nsenter -t "$other" -n sh -c 'ip link set lo up; ip address add 10.213.7.2/24 dev there; ip link set there up; ip route add 224.0.0.0/4 dev there'
export FASTDDS_BUILTIN_TRANSPORTS=UDPv4 # shared memory is no cable
ROS_AUTOMATIC_DISCOVERY_RANGE=$1 "$2" -m rhythmid_nodes.plant --ros-args -r __ns:=/hopper -p model:="$3" &
plant=$!
# at home it is there ...
ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST "$2" "$4" 120
# ... and abroad?
ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET nsenter -t "$other" -n "$2" "$4" "$5"

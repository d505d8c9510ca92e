#!/bin/sh
# Flies a sweep on several machines by GNU parallel over SSH, one shard for each job:
#
#   examples/cluster/parallel.sh delay-loss /shared/delay-loss 16 --sshlogin host1,host2
#   ringwing sweep merge /shared/delay-loss
#
# Further arguments go to parallel. Without --sshlogin all shards fly on this machine.
set -eu

sweep=${1:?give a sweep: a name or a file}
out=${2:?give a folder that all machines share}
count=${3:?give a number of shards}
shift 3

seq "$count" | parallel "$@" "${RINGWING:-ringwing}" sweep "$sweep" --out "$out" --shard "{}/$count" --jobs 1

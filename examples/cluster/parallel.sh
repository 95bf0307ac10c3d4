#!/bin/sh
# GNU parallel, on this machine or on those of --sshlogin: parallel.sh SCENE OUT PARTS [OPTIONS OF parallel]
scene=$1 out=$2 parts=$3; shift 3
seq "$parts" | parallel --retries 3 "$@" lampyris trace "$scene" --threads 1 --shard {}/"$parts" --resume -o "$out/parts" --quiet
lampyris merge "$out/parts" -o "$out/result"

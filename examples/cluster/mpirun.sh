#!/bin/sh
# Open MPI, or any launcher that sets PMI_RANK: mpirun.sh SCENE OUT RANKS [OPTIONS OF mpirun]
scene=$1 out=$2 ranks=$3; shift 3
mpirun -n "$ranks" "$@" lampyris trace "$scene" --threads 1 --shard auto --resume -o "$out/parts" --quiet
lampyris merge "$out/parts" -o "$out/result"

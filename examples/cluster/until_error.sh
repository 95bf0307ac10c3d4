#!/bin/sh
# GNU parallel until an error is small enough: until_error.sh SCENE OUT PARTS 1%@wall [OPTIONS OF parallel]
scene=$1 out=$2 parts=$3 target=$4; shift 4
first=0 last=640000
while :; do
  seq "$parts" | parallel --retries 3 "$@" lampyris trace "$scene" --rays "$first..$last" --threads 1 --shard {}/"$parts" --resume -o "$out/parts" --quiet || exit 1
  answer=$(lampyris merge "$out/parts" -o "$out/result" --until-error "$target" --no-report --json) && exit 0
  missing=$(printf %s "$answer" | sed -n 's/.*"missing_rays": *\([0-9]*\).*/\1/p')
  [ "${missing:-0}" -gt 0 ] || exit 1
  first=$last last=$((last + missing))
done

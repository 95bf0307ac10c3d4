#!/usr/bin/env bash
# Runs every example on this machine and compares digest and receiver files with those of the run at once.
#   test.sh LAMPYRIS SCENE [ENGINE...]     engines: slurm srun mpi dask dask-slurm parallel until_error snakemake kubernetes
# Installs what is missing from Debian and PyPI (as root). An engine that cannot be had is named as skipped.
set -u
program=$(realpath "$1") scene=$(realpath "$2"); shift 2
engines=("$@"); [ ${#engines[@]} -gt 0 ] || engines=(parallel until_error mpi dask snakemake slurm srun dask-slurm kubernetes)
here=$(dirname "$(realpath "$0")"); work=$(mktemp -d); parts=5 failed=0
trap 'stop_slurm; rm -rf "$work"' EXIT
mkdir "$work/bin"; ln -s "$program" "$work/bin/lampyris"; export PATH=$work/bin:$here:$PATH

debian() { command -v "$1" >/dev/null || apt-get install -y -q "${@:2}" >"$work/apt.log" 2>&1 && command -v "$1" >/dev/null; }
python() { [ -d "$work/venv" ] || python3 -m venv "$work/venv"; "$work/venv/bin/pip" install -q "$@" >"$work/pip.log" 2>&1; }

# One node that is controller and worker, for the time of the test.
slurm_node() {
  debian sbatch slurm-wlm munge || return 1
  sinfo >/dev/null 2>&1 && return 0
  pgrep -x munged >/dev/null || {
    mkdir -p /run/munge; chown munge: /run/munge; runuser -u munge -- munged && cp /run/munge/munged.pid "$work/"
  }
  mkdir -p /etc/slurm /var/spool/slurmctld /var/spool/slurmd
  cat >/etc/slurm/slurm.conf <<CONF
ClusterName=one
SlurmctldHost=$(hostname -s)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
StateSaveLocation=/var/spool/slurmctld
SlurmdSpoolDir=/var/spool/slurmd
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
NodeName=$(hostname -s) CPUs=$(nproc) RealMemory=$(free -m | awk '/^Mem/ {print int($2 / 2)}') State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
  slurmctld && slurmd && for _ in $(seq 30); do sinfo -h -t idle 2>/dev/null | grep -q . && return 0; sleep 1; done
  return 1
}
# Stops what slurm_node started, and that alone.
stop_slurm() {
  local daemon
  for daemon in slurmd slurmctld munged; do
    [ -s "$work/$daemon.pid" ] || continue
    kill "$(cat "$work/$daemon.pid")" && for _ in $(seq 50); do kill -0 "$(cat "$work/$daemon.pid" 2>/dev/null)" 2>/dev/null || break; sleep 0.2; done
  done
}
finished() { for _ in $(seq 300); do [ -z "$(squeue -h -j "$1" 2>/dev/null)" ] && return 0; sleep 1; done; return 1; }

run_parallel() { debian parallel parallel || return 9; parallel.sh "$scene" "$1" $parts; }
# Until the error is a third of what it was; then the same rays at once are what it is compared with, as a range too, which chooses facets
# or spline as all ranges do. Facets and octree are built once.
run_until_error() {
  debian parallel parallel || return 9
  local target; target=$(value 'r=d["receivers"][0]; print(str(100 * r["power_error"] / r["power"] / 3) + "%@" + r["name"])' "$work/once")
  LAMPYRIS_CACHE=$1/kept until_error.sh "$scene" "$1" $parts "$target" || return 1
  lampyris trace "$scene" -o "$1/all.tally" -q --rays "0..$(value 'print(d["rays"])' "$1/result")" && lampyris merge "$1/all.tally" -q -o "$1/once"
}
run_mpi() {
  debian mpirun openmpi-bin || return 9
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun.sh "$scene" "$1" $parts --oversubscribe
}
run_dask() { python distributed || return 9; "$work/venv/bin/python" "$here/dask_run.py" "$scene" "$1" $parts; }
run_dask-slurm() {
  slurm_node && python distributed dask-jobqueue || return 9
  (cd "$work" && PATH=$work/venv/bin:$PATH python3 "$here/dask_slurm.py" "$scene" "$1" $parts 2)
}
run_snakemake() {
  python snakemake || return 9
  "$work/venv/bin/snakemake" -q all --cores 2 -s "$here/Snakefile" -d "$1" --config scene="$scene" parts=$parts
}
run_slurm() {
  slurm_node || return 9
  local job merge; export SCENE=$scene OUT=$1
  job=$(cd "$work" && sbatch --parsable --array=1-$parts "$here/array.sbatch") || return 1
  merge=$(cd "$work" && sbatch --parsable -d "afterok:$job" "$here/merge.sbatch") && finished "$merge"
}
run_srun() {
  slurm_node || return 9
  local job; export SCENE=$scene OUT=$1
  job=$(cd "$work" && sbatch --parsable --ntasks=2 "$here/srun.sbatch") && finished "$job"
}
run_kubernetes() {
  python pyyaml kubernetes-validate || return 9
  "$work/venv/bin/kubernetes-validate" --strict "$here/kubernetes.yaml" || return 1
  # What the Job sets for each of its pods.
  for i in $(seq 0 $((parts - 1))); do
    JOB_COMPLETION_INDEX=$i lampyris trace "$scene" --shard auto --shards $parts -o "$1/parts" -q || return 1
  done
  lampyris merge "$1/parts" --wait 10 -o "$1/result"
}

# An engine that hangs ends the test of that engine alone.
wait_for() { ( trap 'kill $nap' TERM; sleep 300 & nap=$!; wait $nap && kill "$1" 2>/dev/null ) & local watch=$!; wait "$1"; local code=$?; kill $watch 2>/dev/null; return $code; }

value() { python3 -c "import json,sys; d=json.load(open(sys.argv[1])); $1" "$2/results.json"; }
digest() { value 'print(d["digest"])' "$1"; }
lampyris trace "$scene" -o "$work/once" -q || exit 1
for engine in "${engines[@]}"; do
  out=$work/$engine; mkdir -p "$out"
  "run_$engine" "$out" >"$work/$engine.log" 2>&1 & wait_for $!; code=$?
  once=$work/once; [ ! -d "$out/once" ] || once=$out/once
  if [ $code -eq 9 ]; then
    echo "$engine: skipped, it cannot be installed here"
  elif [ $code -ne 0 ] || [ "$(digest "$once")" != "$(digest "$out/result")" ]; then
    echo "$engine: FAILED"; tail -n 20 "$work/$engine.log" "$work"/*.log; failed=1
  else
    differing=$(for f in "$once"/*.{csv,npz,vti,data3}; do [ ! -e "$f" ] || cmp -s "$f" "$out/result/$(basename "$f")" || basename "$f"; done)
    if [ -n "$differing" ]; then echo "$engine: FAILED, files differ: $differing"; failed=1; else echo "$engine: same digest, same files"; fi
  fi
done
exit $failed

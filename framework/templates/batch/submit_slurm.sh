#!/bin/sh
# Submits the unfinished tasks as array jobs that depend on each other. After a failure, submit again.
job=$(cd "$(dirname "$0")" && pwd)
. "$job/plan.sh"
. "$job/environment.sh"
. "$job/missing.sh"
# squeue fails if the cluster no longer knows the jobs; they are not running then.
running=$(squeue --noheader --jobs="$(paste -sd, "$job/log/slurm-jobs" 2>/dev/null)" 2>/dev/null)
if [ -s "$job/log/slurm-jobs" ] && [ -n "$running" ]; then
  echo "jobs of this folder still wait or run; scancel ends them:" >&2
  echo "$running" >&2
  exit 1
fi
: >"$job/log/slurm-jobs"
after=
submit() { # NAME MEMORY TIME [OPTION...]: submits a job that the next one depends on
  name=$1 memory=$2 time=$3
  shift 3
  task="sh '$job/task.sh' $name"
  case "$*" in *--array*) task="$task \$SLURM_ARRAY_TASK_ID" ;; esac
  id=$(sbatch --parsable --job-name="tofgraph-$name" --mem="$memory" --time="$time" --cpus-per-task="$THREADS" \
    --requeue --output="$job/log/slurm-$name-%j.log" $SBATCH_OPTIONS $after "$@" --wrap "$task") || exit 1
  id=${id%%;*}
  echo "$id" >>"$job/log/slurm-jobs"
  after="--dependency=afterok:$id --kill-on-invalid-dep=yes"
  echo "$name: job $id"
}
list=$(missing_shards | paste -sd, -)
[ -z "$list" ] || submit reduce "$REDUCE_MEMORY" "$REDUCE_TIME" --array="$list"
is_merged || submit merge "$REDUCE_MEMORY" "$REDUCE_TIME"
list=$(missing_cases | paste -sd, -)
[ -z "$list" ] || submit case "$DIAGNOSE_MEMORY" "$DIAGNOSE_TIME" --array="$list"
is_diagnosed || submit diagnose "$DIAGNOSE_MEMORY" "$DIAGNOSE_TIME"

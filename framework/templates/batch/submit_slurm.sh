#!/bin/sh
# Submits what is not done: array jobs that wait for each other. After a failure, submit again.
job=$(cd "$(dirname "$0")" && pwd)
. "$job/plan.sh"
. "$job/environment.sh"
. "$job/missing.sh"
after=
submit() { # NAME MEMORY TIME [OPTION...]: adds a job that the next one waits for
  name=$1 memory=$2 time=$3
  shift 3
  task="sh '$job/task.sh' $name"
  case "$*" in *--array*) task="$task \$SLURM_ARRAY_TASK_ID" ;; esac
  id=$(sbatch --parsable --job-name="tofgraph-$name" --mem="$memory" --time="$time" --cpus-per-task="$THREADS" \
    --requeue --output="$job/log/slurm-$name-%j.log" $SBATCH_OPTIONS $after "$@" --wrap "$task") || exit 1
  after="--dependency=afterok:$id --kill-on-invalid-dep=yes"
  echo "$name: job $id"
}
list=$(missing_shards | paste -sd, -)
[ -z "$list" ] || submit reduce "$REDUCE_MEMORY" "$REDUCE_TIME" --array="$list"
is_merged || submit merge "$REDUCE_MEMORY" "$REDUCE_TIME"
list=$(missing_cases | paste -sd, -)
[ -z "$list" ] || submit case "$DIAGNOSE_MEMORY" "$DIAGNOSE_TIME" --array="$list"
is_diagnosed || submit diagnose "$DIAGNOSE_MEMORY" "$DIAGNOSE_TIME"

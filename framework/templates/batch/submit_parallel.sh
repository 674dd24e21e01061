#!/bin/sh
# Runs the unfinished tasks with GNU parallel on this machine. After a failure, run it again.
job=$(cd "$(dirname "$0")" && pwd)
. "$job/plan.sh"
. "$job/environment.sh"
. "$job/missing.sh"
tasks() { # NAME: runs the tasks whose numbers are read from standard input
  numbers=$(cat)
  [ -z "$numbers" ] || echo "$numbers" | parallel -q --will-cite --jobs "${JOBS:-100%}" \
    --joblog "$job/log/$1-joblog" sh "$job/task.sh" "$1"
}
missing_shards | tasks reduce && { is_merged || sh "$job/task.sh" merge; } && missing_cases | tasks case &&
  { is_diagnosed || sh "$job/task.sh" diagnose; }
code=$?
sh "$job/status.sh"
exit $code

#!/bin/sh
# Runs the unfinished tasks one after the other, each on all cores. After a failure, run it again.
job=$(cd "$(dirname "$0")" && pwd)
. "$job/plan.sh"
. "$job/environment.sh"
. "$job/missing.sh"
tasks() { # NAME: runs the tasks whose numbers are read from standard input
  while read -r number; do sh "$job/task.sh" "$1" "$number" </dev/null || return 1; done
}
missing_shards | tasks reduce && { is_merged || sh "$job/task.sh" merge; } && missing_cases | tasks case &&
  { is_diagnosed || sh "$job/task.sh" diagnose; }
code=$?
sh "$job/status.sh"
exit $code

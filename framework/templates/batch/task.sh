#!/bin/sh
# Runs one task of the job: task.sh reduce I, merge, case I, or diagnose. A repetition leaves complete outputs as is.
job=$(cd "$(dirname "$0")" && pwd)
. "$job/plan.sh"
. "$job/environment.sh"
log="$job/log/$1${2:+-$2}.log"
exec >>"$log" 2>&1
echo "$(date -u '+%Y-%m-%d %H:%M:%S') begins on $(uname -n)"
case $1 in
  reduce) "$TOFGRAPH" reduce "$CAMPAIGN" -o "$STATS" --shard "$2/$SHARDS" --threads "$THREADS" ;;
  merge) "$TOFGRAPH" merge "$STATS" ;;
  case) "$TOFGRAPH" diagnose --model "$MODEL" --data "$STATS" -o "$RESULT" --confidence "$CASES" \
          --shard "$2/$CASE_SHARDS" --threads "$THREADS" ;;
  diagnose) "$TOFGRAPH" diagnose --model "$MODEL" --data "$STATS" -o "$RESULT" --confidence "$CASES" --force ;;
  *) echo "unknown task '$1'"; exit 2 ;;
esac
code=$?
echo "$(date -u '+%Y-%m-%d %H:%M:%S') ends with exit code $code"
exit $code

#!/bin/sh
# Progress of the job, from its outputs and logs.
job=$(cd "$(dirname "$0")" && pwd)
. "$job/plan.sh"
. "$job/missing.sh"
count() { printf '%s' "$1" | grep -c .; }
line() { # NAME ALL MISSING
  open=$(count "$3")
  printf '%-10s %s of %s done' "$1" $(($2 - open)) "$2"
  [ "$open" -gt 0 ] && printf ', missing: %s' "$(echo "$3" | head -n 20 | tr '\n' ' ')"
  echo
}
line reduce "$SHARDS" "$(missing_shards)"
line merge 1 "$(is_merged || echo merge)"
[ "$CASES" -gt 0 ] && line cases "$CASE_SHARDS" "$(missing_cases)"
line diagnose 1 "$(is_diagnosed || echo diagnose)"
for log in "$job"/log/*.log; do
  [ -e "$log" ] || continue
  failed=$(tail -n 1 "$log" | grep "exit code [^0]") && echo "failed: $log: $(grep -i error "$log" | tail -n 1)"
done
is_diagnosed && echo "result: $RESULT/report.html" || echo "to go on: sh $job/submit.sh"
exit 0

# Unfinished tasks, for submit.sh and status.sh, determined from the outputs alone.
missing_shards() {
  i=1
  while [ "$i" -le "$SHARDS" ]; do
    [ -e "$STATS/shards/$i-of-$SHARDS.json" ] || echo "$i"
    i=$((i + 1))
  done
}
# A shard of cases is done if its log says so. Cases run twice do no harm: they only add a file that is read.
missing_cases() {
  [ "$CASES" -gt 0 ] || return 0
  i=1
  while [ "$i" -le "$CASE_SHARDS" ]; do
    tail -n 1 "$job/log/case-$i.log" 2>/dev/null | grep -q "exit code 0" || echo "$i"
    i=$((i + 1))
  done
}
# While a shard is missing, an existing campaign.yaml is out of date.
is_merged() { [ -z "$(missing_shards)" ] && [ -e "$STATS/campaign.yaml" ]; }
is_diagnosed() { [ -e "$RESULT/report.html" ]; }

# Tasks that are not done, for submit.sh and status.sh: what is done is seen by the outputs alone.
missing_shards() {
  i=1
  while [ "$i" -le "$SHARDS" ]; do
    [ -e "$STATS/shards/$i-of-$SHARDS.json" ] || echo "$i"
    i=$((i + 1))
  done
}
# A shard of cases is done when its log says so: a case that is there twice costs one file that is read.
missing_cases() {
  [ "$CASES" -gt 0 ] || return 0
  i=1
  while [ "$i" -le "$CASE_SHARDS" ]; do
    tail -n 1 "$job/log/case-$i.log" 2>/dev/null | grep -q "exit code 0" || echo "$i"
    i=$((i + 1))
  done
}
# While a shard is missing, a campaign.yaml that is there is one of before.
is_merged() { [ -z "$(missing_shards)" ] && [ -e "$STATS/campaign.yaml" ]; }
is_diagnosed() { [ -e "$RESULT/report.html" ]; }

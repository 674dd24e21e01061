# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# Draws corrected_clouds.png, from the repository's root after
#   tofgraph run pipelines/full_correction.yaml --set save.encoding=ascii --set save_measured.encoding=ascii
set terminal pngcairo size 1200,400 font "sans,11"
set output "docs/corrected_clouds.png"
set multiplot layout 1,3 margins 0.06,0.99,0.13,0.91 spacing 0.06,0
set grid lc rgb "#dddddd"
set xlabel "x, m"
f = 0.0128 # m, from the sensor plane to the lens centre
middle(row) = row >= 85 && row < 119
cloud(name) = "< sed 1,11d pipelines/out/full_correction/".name."_000000.pcd"
do for [i=1:3] {
  z = word("2.0 2.5 4.0", i) + 0
  a = word("-0.70 -0.24 0.54", i) + 0
  b = word("-0.26 0.24 1.38", i) + 0
  set xrange [a-0.03:b+0.03]
  set yrange [z-0.06:z+0.06]
  set ylabel i == 1 ? "depth from the sensor plane, m" : ""
  set title sprintf("a paper at %.1f m, from above", z)
  if (i == 1) { set key inside bottom left Left reverse } else { unset key }
  plot cloud("as_measured") using (middle(int($0/204)) ? $1 : NaN):($3+f) with points pt 7 ps 0.25 lc rgb "#3465a4" title "geometry alone", \
       cloud("cloud") using (middle(int($0/204)) ? $1 : NaN):($3+f) with points pt 7 ps 0.25 lc rgb "#cc3333" title "all corrections", \
       z with lines lc rgb "black" title "where it is"
}

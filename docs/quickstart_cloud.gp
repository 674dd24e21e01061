# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# Draws quickstart_cloud.png from the first cloud of the quickstart:
#   tofgraph run pipelines/quickstart.yaml --frames 1 --force --set clouds.encoding=ascii
#   gnuplot docs/quickstart_cloud.gp
set terminal pngcairo size 1000, 700 font 'sans,11'
set output 'docs/quickstart_cloud.png'
set xlabel 'x / m' offset 0, -0.5
set ylabel 'z / m' offset 1, -1
set zlabel 'height, -y / m' offset -1, 0 rotate by 90
set cblabel 'z / m'
set colorbox user origin 0.9, 0.25 size 0.02, 0.5
set xrange [-1.3:1.3]
set yrange [1:2.3]
set zrange [-0.8:0.9]                             # y points down
set ztics 0.4
set ytics 0.4
set xyplane at -0.8
set cbrange [1.2:2]
set palette defined (0 '#440154', 1 '#3b528b', 2 '#21918c', 3 '#5ec962', 4 '#fde725')
set view 65, 20, 1.7
set view equal xyz
unset key
set origin -0.05, 0
splot 'pipelines/out/quickstart/cloud_000000.pcd' every ::11 using 1:3:(-$2):3 with points pointtype 7 pointsize 0.35 palette

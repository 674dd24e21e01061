# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Text of reference_results.py around the computed numbers: commands, printed numbers, reasons."""

DECODE = "four_phase_decoder"
CLOUD = "optimized_bistatic ! point_cloud ! pcd_writer encoding=ascii"

COMMANDS = {
    "cameras": ["tofgraph list cameras --compare"],
    "warm-up": [
        "tofgraph simulate pipelines/campaigns/warm_up.yaml "
        "--model pipelines/campaigns/warm_up_published.model.yaml -o out/warm_up",
        "tofgraph calibrate warm-up out/warm_up/campaign.yaml -o out/warm_up.yaml"],
    "rmse": [
        "tofgraph simulate pipelines/chapter3/rmse_8h.yaml -o out/rmse",
        "tofgraph calibrate warm-up out/rmse/campaign.yaml -o out/rmse.yaml --corrected-at 60min"],
    "ideal": [
        f"tofgraph run \"simulator distance=500mm noise=none ! {DECODE} name=measured ! "
        "statistics path=out/ideal.csv\" --camera camcube2",
        f"tofgraph run \"simulator distance=500mm noise=none ! {DECODE} ! {CLOUD} "
        "path=out/ideal_{frame}.pcd\" --camera camcube2"],
    "physical": [
        "tofgraph run \"simulator distance=500mm noise=none model=pipelines/chapter5/physical_light.model.yaml ! "
        f"{DECODE} ! {CLOUD} path=out/physical_{{frame}}.pcd\" --camera camcube2"],
    "models": ["tofgraph run pipelines/compare_models.yaml"],
    "single": [
        "tofgraph simulate pipelines/chapter5/single_sources.yaml -o out/sources",
        "tofgraph run pipelines/chapter5/single_source_models.yaml --campaign out/sources/campaign.yaml -o out/models"],
    "mean": [
        "tofgraph run \"simulator distance=505.02mm reflectivity=0.882 integration_time=0.5ms frames=250 ! "
        f"{DECODE} ! average frames=250 ! optimized_bistatic ! statistics value=505.02mm path=out/mean.csv\" "
        "--camera camcube2"],
    "offset": [
        f"tofgraph calibrate offset pipelines/campaigns/thesis_tables.yaml --variant {variant} "
        f"-o out/offset_{variant}.yaml"
        for variant in ("printed", "geometric")],
    "wrapped": [
        f"tofgraph run \"simulator distance=7500mm noise=none ! {DECODE} ! "
        "statistics columns=[88,115] rows=[95,108] path=out/wrapped.csv\" --camera camcube2"],
    "tables": [
        "tofgraph simulate pipelines/chapter6/offset_tables.yaml -o out/tables",
        "tofgraph calibrate offset out/tables/campaign.yaml --variant printed --force -o out/tables.yaml"],
    "times": [
        "tofgraph calibrate integration-time pipelines/campaigns/thesis_tables.yaml -o out/published_times.yaml",
        "tofgraph simulate pipelines/chapter6/integration_times.yaml -o out/times",
        "tofgraph calibrate integration-time out/times/campaign.yaml -o out/simulated_times.yaml",
        "tofgraph calibrate offset out/times/campaign.yaml --force -o out/times_boards.yaml"],
    "centre": [
        "tofgraph simulate pipelines/chapter6/centre_pixels.yaml -o out/centre",
        "tofgraph calibrate offset out/centre/campaign.yaml --force -o out/centre.yaml"],
    "matrix": ["tofgraph run pipelines/chapter6/offset_matrix.yaml",
               "tofgraph run pipelines/chapter6/modelled_board.yaml"],
    "noise": ["tofgraph run pipelines/chapter7/gaussian_noise.yaml"],
    "box": ["tofgraph run pipelines/chapter7/box_before_wall.yaml"],
    "denoisers": ["tofgraph run pipelines/compare_denoisers.yaml"],
}

CHAPTER_1 = [
    ["table 1.1, CamCube 2.0", "cameras", "204 x 204, PMD 41k-S2, 0.3 to 7 m, 40 x 40 deg, 80 frames/s, USB",
     "{camcube2}", "-"],
    ["table 1.1, SR4000", "cameras", "176 x 144, sensor n.a., 0.8 to 8 m, 43 x 34 deg, 50 frames/s, USB/Ethernet",
     "{sr4000}", "-"],
    ["table 1.2, O3", "cameras", "64 x 48, PMD, 0.3 to 7 m, 40 x 30 deg, 25 frames/s, Ethernet", "{o3}", "-"],
    ["table 1.2, S3", "cameras", "64 x 48, PMD 3k-S2, 0.3 to 7 m, 40 x 30 deg, 20 frames/s, Ethernet", "{s3}", "-"],
]

DRIFT = ("given: the means set the model's offsets, the σ the size of its drift, so neither is a prediction. Print read the "
         "distance continuously, so both are over the time: a drift with a time constant of 15 min has a σ of 12.1 % of "
         "its size over 8 h. 53 mm, as an upper bound, since all else that scatters in the readings is in σ, too; one "
         "drift stands for all times, as the printed σ do not rise with the time")

CHAPTER_3 = [
    ["figure 3.1", "-", "drawing", "-", "experimental setup"],
    ["table 3.1, 5 ms, µ / σ", "warm-up", "2941.4 / 6.6", "{t0}", DRIFT],
    ["table 3.1, 25 ms", "warm-up", "3033.1 / 8.2", "{t1}", "as above"],
    ["table 3.1, 50 ms", "warm-up", "3096.7 / 4.8", "{t2}", "as above"],
    ["figure 3.2", "warm-up", "stable after about 60 min",
     "within 2 mm after {settled} min, time constant {constant} min; curves in `out/warm_up.html`",
     "the unsteady first minutes and the weaker drift at 5 ms: not in the model; the sign of the drift is not "
     "published"],
    ["figure 3.3, RMSE over 8 h", "rmse", "falls for 60 min to about 16, rises after 4 h",
     "{first} at power-on, {hour} after 1 h, {four} after 4 h, {last} after 8 h",
     "the level is given: the noise of `camcube2_measured` was set by it; the slow drift behind the rise is assumed, as "
     "neither its size nor its cause is published; the value at power-on follows from the drift of table 3.1, an upper "
     "bound, and is not printed"],
]

RAW = "no image of the real camera is published"
SPREAD = "printed: the mean of 500 frames, so residual curvature and fixed pattern; obtained: noise of single frames"
CHAPTER_5 = [
    ["figures 5.1, 5.4, 5.7, 5.11 to 5.19", "-", "drawings", "-", "geometry, signal path, setup"],
    ["figures 5.2, 5.3, 5.5, 5.6", "-", "signals", "-",
     "drawn at the end of the page of `tofgraph gallery`, which takes a minute and is not run for this page; the effect "
     "`finite_integration` puts windows into the simulation"],
    ["figures 5.8, 5.20: modelled distance, 500 mm", "ideal", "500 to 550 mm", "{ideal}", "-"],
    ["figures 5.9, 5.22: attenuation", "ideal", "0.90 to 1", "{attenuation} to 1",
     "obtained is the corner; the end of the middle row has 0.91, which may be what is printed"],
    ["figure 5.10: distribution", "-", "0.001 of the attenuation", "-",
     "drawn there, too, as the loss: about 18 ppm, 0.0002 of the attenuation; with the misprinted w / c (below) it is "
     "four times as much, near the printed 0.001"],
    ["figure 5.21: measured distance", "models", "480 to 550 mm", "{both_range}", RAW + "; the twin's with its noise"],
    ["figure 5.23: measured amplitude", "physical", "0.2 to 1", "{physical} to 1",
     "Lambert's law and cos^4 of the lens only; beam profile and vignetting of the camera are not published"],
    ["table 5.1 (left), measured, µ / σ", "single", "461.27 / 13.88", "{left_measured}", SPREAD],
    ["table 5.1, simple bistatic", "single", "432.98 / 6.75, with f: 445.78", "{left_simple_bistatic}",
     "the printed mean lacks f"],
    ["table 5.1, optimized bistatic", "single", "445.55 / 6.93", "{left_optimized}",
     "given: the board is put where this row says, as it was said to stand at 500 mm"],
    ["table 5.2 (right), measured", "single", "476.13 / 13.54", "{right_measured}", "as table 5.1"],
    ["table 5.2, simple bistatic", "single", "447.35 / 5.90, with f: 460.15", "{right_simple_bistatic}",
     "the printed mean lacks f"],
    ["table 5.2, optimized bistatic", "single", "459.98 / 6.04", "{right_optimized}", "given, as above"],
    ["table 5.3, measured", "models", "523.57 / 10.89", "{both_measured}",
     "the real camera measured 1.1 mm more than the mean of the paths; the twin has no such error"],
    ["table 5.3, perpendicular illumination", "models", "513.16 / 5.66", "{both_perpendicular}",
     "obtained is 0.8 mm more; not explained"],
    ["table 5.3, simple bistatic", "models", "505.07 / 2.76", "{both_simple_bistatic}", "-"],
    ["table 5.3, optimized bistatic", "models", "505.02 / 2.77", "{both_optimized}", "mean given; σ: see below"],
    ["figures 5.24 to 5.35: images of these tables", "models, single", "images", "their means and σ: above",
     "pictures need `surface_writer`, as in `pipelines/chapter7`; " + RAW],
]

CHAPTER_6 = [
    ["figures 6.1, 6.2", "-", "drawings", "-", "geometry, setup"],
    ["figures 6.3, 6.4", "centre", "images", "simulated, below", RAW + "; no number is printed"],
    ["table 6.1, figures 6.5, 6.6: modelled", "offset", "517.32 / 10.03", "{modelled}", "-"],
    ["table 6.1: measured, corrected", "-", "525.26 / 11.86, 507.66 / 3.85", "given", RAW],
    ["table 6.1, figure 6.6: re-modelled", "offset", "525.09 / 10.11", "{remodelled}", "-"],
    ["table 6.1, figure 6.6: offset", "offset", "-7.77 / 0.09", "{offset}", "-"],
    ["table 6.1, figure 6.8: corrected for both", "offset", "500.14 / 3.87", "{final}",
     "σ follows from the given 3.84"],
    ["figures 6.5, 6.7: modelled", "matrix", "517.32 / 10.03", "{ideal_modelled}",
     "pictures beside the measured ones; the re-modelled distance of figure 6.6 differs from it by the offset matrix, which "
     "is drawn"],
    ["figures 6.5 to 6.8: measured", "tables, matrix", "525.26 / 11.86", "{twin_measured}",
     "simulated by `camcube2_measured`; pictures in `pipelines/chapter6/out`"],
    ["figure 6.5: corrected", "matrix", "507.66 / 3.85", "{twin_corrected}", "as above"],
    ["figure 6.7: offset corrected", "matrix", "517.49 / 11.78", "{twin_offset}", "as above"],
    ["figure 6.8: corrected for both", "matrix", "500.14 / 3.87", "{twin_final}", "as above"],
    ["tables 6.2 to 6.13, 7500 mm: modelled", "wrapped", "7503.06 / 2.20", "{wrapped}",
     "beyond the unambiguous range of 7494.81 mm: less that, as a camera measures it"],
    ["tables 6.2 to 6.13, 7500 mm: measured", "-", "158.23 / 8.25 (white)", "-",
     "150 mm off the model: the real camera; not used, and the offset is n.a. in print, too"],
]

OFFSET_TABLES = """Worst deviation from print in mm over the rows of a table: 14 rows of each, all but 7500 mm
(above). Given are the corrected depths N.L.C.D (µ and σ) and the times. Ms.D µ is computed back from N.L.C.D: it
agrees with O.C.D less O.M, but in {apart} of {all} rows, of dark or far boards, the printed Ms.D + O.M is more than
0.1 mm (up to {farthest} mm) off the printed O.C.D: pixels are missing in the latter, see below. σ of Ms.D and of
O.C.D are not reproduced here, they need the images. {restored} cells of O.M whose digits are lost in the text are
restored from Mo.D - R.V.D, so there O.M is no evidence of its own. `printed` takes the reflected path of the
re-modelled board as the tables do, `geometric` (default) where the board was measured.
"""

TWIN = """### Tables 6.2 to 6.13, simulated

Each cell: printed / simulated, mm. The twin is the profile `camcube2_measured` with its model
(`devices/calibrations/camcube2_measured.model.yaml`): a pattern of 4.0 mm and crosstalk that differs by 110 counts/s
from pixel to pixel, drawn; crosstalk, waveform and integration-time offset for the means; and noise, from the 16 mm
of a single frame in figure 3.3, which 250 frames reduce to 1 mm. `python3 tests/published_spread.py` fits the model
to the means of all rows and to the σ of N.L.C.D at the odd multiples of 500 mm; the others are held out. The
reflectivities of the sheets are fitted with it. The board's true place is given, the rest is simulated.

The printed N.L.C.D lack pixels that are farther than about 20 mm from the middle: in the seven rows whose σ of Ms.D is
20 to 50 mm that of N.L.C.D stays below 11.5 mm, which is that of 40 mm evenly filled, and in these rows the printed
mean of O.C.D is not that of Ms.D + O.M. This reach is inferred; `--variant printed` applies it to N.L.C.D, not to
Ms.D. The simulated σ beside N.L.C.D is that after both corrections, which differs by 0.04 mm at most. The fit gives the
75 % and the 100 % sheet the same reflectivity, so they hardly differ.

σ of N.L.C.D is within 25 % of print in {all} rows: in {fitted} of the fitted rows, and in {judged} of the held-out
ones. The root mean square errors of its means, all fitted, are {fitted_mean} and {judged_mean} mm. Not matched:

- σ of Ms.D, held out as well, is within 25 % in {measured} rows. For the dark sheets from 3.5 m on it is up
to six times the printed one: there the σ of N.L.C.D agrees because both exclude pixels beyond the reach, the
twin too many. A fit to both σ gave 67 of 84 (N.L.C.D) and 70 of 84 (Ms.D).

- σ at 5 and 5.5 m, of all sheets: the printed ones are a quarter smaller than those before and after. `tofgraph
diagnose` reports them, too: "no law explains those of distance 5 m".

- σ of the darkest boards at 6.5 and 7 m: print falls to 6.7 mm where the twin fills the reach. By Ms.D
these pixels spread by 40 to 50 mm, which no normal distribution with a core of 7 mm has. Single frames that wrap at
7.49 m would explain it, as each shifts the mean of 250 by 30 mm. The twin's mean is one frame with the noise of 250.

- Table 5.3 has σ 2.77 mm for the white board at 500 mm and 0.5 ms, table 6.2 has 3.84 mm: one pattern cannot have
both.
"""

TIMES = """Optimal integration times by target and distance. The published boards were selected by the least RMSE, so
`calibrate integration-time` takes the one time that each has as its optimum: {same} of {rows} rows of table 6.14 as
printed. Their RMSE is computed from means and σ of the depths; it deviates from print by {typical} mm in the median
and {worst} mm at worst: N.L.C.D lacks the far pixels that (6.7) sums over. Only one row beyond 2500 mm, of the white
sheet at 3000 mm, can be read in the text (13 ms, 3.95 mm, as obtained); tables 6.2 to 6.13 have their times, without
RMSE. Figures 6.9 to 6.11 (RMSE over all times) were published as images only: those of the twin are below.

The twin is `camcube2_measured`. Its RMSE is within 25 % of print in {near} of {rows} rows; its optimum is within a
factor 2 of the printed time in {within} of the {all} rows of tables 6.2 to 6.13, {white} of 14 of the white sheet. A
full well of 5300 counts, set by the bright sheets at 500 mm, limits the times of the bright sheets; saturated times
have no optimum and are grey in the pictures. The scene is recorded as phases, which do not clip: a time counts as
saturated from where the profile's full well would be reached. For the dark ones the simulated optimum is up to six
times as long as the camera's. Noise falls with the time and the pattern stays: at the printed times of the 50, 75 and
100 % sheets the twin's RMSE is {flat} times that at its optimum in the median. The twin lacks the cause of the
renewed rise of the camera's RMSE: an error that grows with the time for dark boards only. Light by way of the rig,
and dark current that differs from pixel to pixel, are candidates; neither was tested, and no constant was tuned to
hit these times.
"""

CHAPTER_7 = [
    ["figure 7.1, right", "noise", "σ = 10 mm, added", "{gaussian_noise_noisy}", "-"],
    ["figure 7.2, left: Yaroslavsky", "noise", "image", "{gaussian_noise_yaroslavsky}",
     "no number is printed; the arrangement of the boxes is not published"],
    ["figure 7.2, right: bilateral", "noise", "image", "{gaussian_noise_bilateral}", "as above"],
    ["figure 7.3: non-local means", "noise", "image", "{gaussian_noise_non_local_means}", "as above"],
    ["figure 7.4", "-", "drawing", "-", "setup; its box and distances are in `pipelines/scenes/box_before_wall.yaml`"],
    ["figures 7.5, 7.8, 7.11: measured and corrected", "box", "images",
     "{box_before_wall_uncorrected} before the offset correction, {box_before_wall_corrected} after",
     RAW + "; simulated scene with the offset of table 6.2 at 0.5 ms, 7.77 mm, of which the published calibration takes off "
     "8.4 mm at the wall and 4.5 mm at the box, by its reflectivity: 0.6 and 3.2 mm of bias are in all values below; print "
     "corrects the white areas only, the pipeline the whole image"],
    ["figures 7.6, 7.9, 7.12, left: Yaroslavsky", "box", "images", "{box_before_wall_yaroslavsky}", "as above"],
    ["figures 7.6, 7.9, 7.12, right: bilateral", "box", "images", "{box_before_wall_bilateral}", "as above"],
    ["figures 7.7, 7.10, 7.13: non-local means", "box", "images", "{box_before_wall_non_local_means}", "as above"],
]

ORDER_TEXT = """The reference names non-local means the most accurate of its three filters, and gives no order of
the other two. Root mean square errors in mm, beside that order; below it, filters that the reference does not have.
The pallet has the noise of the camera's profile, pixels that mix two surfaces removed first, and the filters'
strength by (7.9).
"""
ORDER_HEAD = ["filter", "the reference's order", "10 mm of Gaussian noise", "box before a wall", "pallet"]
ORDER = [
    ["non_local_means", "the best", "{gaussian_noise_non_local_means}", "{box_before_wall_non_local_means}",
     "{pallet_non_local_means}"],
    ["bilateral", "not stated", "{gaussian_noise_bilateral}", "{box_before_wall_bilateral}", "{pallet_bilateral}"],
    ["yaroslavsky", "not stated", "{gaussian_noise_yaroslavsky}", "{box_before_wall_yaroslavsky}",
     "{pallet_yaroslavsky}"],
    ["median, 3 x 3", "-", "-", "-", "{pallet_median}"],
    ["non_local_means, guide: amplitude", "-", "-", "-", "{pallet_guided}"],
    ["the same, patch_weights: robust", "-", "-", "-", "{pallet_robust}"],
    ["non_local_means, sigma_adaptive: true", "-", "-", "-", "{pallet_adaptive}"],
]

PAGE = """# The reference's tables and figures, reproduced

Every table and figure of chapters 1, 3, 5, 6 and 7 of the reference, the master's thesis that the
[README](../README.md#citation) cites: the command, what is printed, what comes out, and what is not reproduced.
`python3 tests/reference_results.py` runs the commands and writes this page; a test says when it is stale. Lengths in
mm, µ / σ where there are two; "given" is what goes in. The real camera has published statistics, but no images:
simulations show that the formulas and the twin agree with print, not what the camera did.

Not here: chapter 2 has no measurements; table 4.1 (lens) needs the images of a chessboard, which are not published;
its numbers are those of the profile `camcube2_calibrated`, and [calibrate the lens](calibrate_lens.md) finds a
simulated one.

## Chapter 1

{first}
## Chapter 3

{third}
Table 3.1 is simulated by `camcube2`, figure 3.3 by `camcube2_measured`. The full well of the latter, 5300 counts, which
the bright boards of table 6.14 need, is exceeded by a white board at 3 m from 21 ms on, where table 3.1 has 25 and
50 ms: one full well cannot have both.

## Chapter 5

{fifth}
The printed σ of 2.77 mm (table 5.3) is the spread over the pixels of a mean of 500 frames (section 5.7.2;
250 in chapter 6): mostly fixed pattern and residual curvature, little noise. The twin, without either and with an
assumed noise, has {single_frame} mm in one frame and {mean_frame} mm in the mean of 250 frames. That the first is
close to 2.77 mm was set by the board's reflectivity in `compare_models.yaml`; it is no measurement of the camera's
noise. Figure 3.3 states 16 mm for single frames, from which the profile `camcube2_measured` (below) has its noise.

## Chapter 6

{sixth}
### Figures 6.3 and 6.4, simulated

Error of the distance, and amplitude, of the four centre pixels over distance and integration time. According to the
reference the distance varies linearly with the time; it shows no numbers. Points with a full tap are left out.

![Distance and amplitude of the centre pixels, simulated](reference_centre_pixels.svg)

### Table 6.14, figures 6.9 to 6.11

{times}
![Optimal integration times, published and simulated](reference_integration_times.svg)

![RMSE over distance and integration time, simulated](reference_rmse.svg)

## Chapter 7

Root mean square errors of the depth against the true one; each command writes the pictures of its figures.

{seventh}
## Misprints

Printed without `+ f`: the row "Bistatic Model" of tables 5.1 and 5.2 counts from the lens centre, where (5.174) and
all other rows count from the sensor plane: 12.8 mm are added.

Equations that were repaired:

| equation | in print | used |
| --- | --- | --- |
| (2.3), (5.62) | arctan of a quotient: loses the quadrant | atan2(c3 - c1, c0 - c2) |
| (2.4) | c / (2 f) times the phase: a factor 2 pi too much | c / (4 pi f) times the phase |
| (2.2), (2.5), (5.63) | the amplitude with and without 1/2 | a = sqrt((c3 - c1)^2 + (c0 - c2)^2) / 2 |
| (5.20), (5.67), (5.88), (5.93) | w / c (D1 - D2) | w / (2 c) (D1 - D2), as (5.16) |
| (5.56) | limits -d to d for both terms, though the windows overlap around -t/2 | envelope cos(w t) + sin(w (T - abs(t))) / (w T), relative |
| (5.77) | no square root, Ox for Oy | cos(theta) = f / hypot(r, f) |
| (5.101) | x and z of the ray exchanged | as (5.72), (5.114) |
| (6.4) in tables 6.3 to 6.13 | path D_ref(T) + (D_avg - T) | D_ref(D_avg); `--variant printed` for the tables |
| (7.1) to (7.4) | exp of a positive square | exp(-...) |
| (7.8) | the sum is missing | sum over the search window |

## Commands

In the project's folder, `mkdir -p out` before; a second run needs `--force`. `calibrate offset .. --force` also writes
a calibration that does not improve held-out boards: of the simulated tables only the statistics of each condition are
used. Beside each calibration (`NAME.yaml`) lies its report, `NAME.html`, with the numbers of each condition; pipelines
write to `out` beside their file, with `--campaign` one `.csv` per condition. "times" takes 4 minutes and 1.2 GB,
"warm-up" 0.3 GB, "centre" 0.2 GB.
{commands}"""

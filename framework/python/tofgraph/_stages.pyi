# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# Made from the declarations by `tofgraph manual`; do not edit.
"""Stages of the program's own plugins, as nodes of a pipeline. `more`: name, inputs, queue, overwrite."""

from os import PathLike
from typing import Any, Callable, Literal, Sequence

from ._pipeline import Node

class Stages:
    def camcube(self, *, name: str = ..., backend: Literal["auto", "pmdsdk", "usb", "replay", "simulated"] = ..., integration_time: str = ..., auto_integration_time: bool = ..., amplitude_low: str = ..., amplitude_high: str = ..., amplitude_percentile: float | str = ..., calibration: str | PathLike[str] = ..., modulation_frequency: str = ..., frame_rate: str = ..., reconnect: bool = ..., timeout: str = ..., phase_order: Sequence[float | str] = ..., device: Any = ..., protocol: str | PathLike[str] = ..., library: str | PathLike[str] = ..., source_plugin: Any = ..., source_parameter: Any = ..., processing_plugin: Any = ..., processing_parameter: Any = ..., deliver: Literal["raw", "images"] = ..., vendor_calibration: bool = ..., roi: Sequence[float | str] = ..., exposure_mode: Any = ..., commands: Any = ..., file: str | PathLike[str] = ..., pace: Literal["recorded", "fast"] = ..., loop: bool = ..., scene: str | PathLike[str] = ..., condition: int = ..., **more: Any) -> Node:
        """A live camera: a PMD CamCube (not verified on hardware), a recording or a simulation in its place.

        @param backend auto: the one that a given parameter is of (file, scene, library, device), else the first of pmdsdk (the vendor's library) and usb that finds a camera; these two are not verified on hardware; default auto
        @param integration_time integration time of each phase image; default: the camera's own [s], at least 0 s
        @param auto_integration_time keeps the amplitude between amplitude_low and amplitude_high by changing the integration time from frame to frame, from integration_time on; never into saturation; default false
        @param amplitude_low see above [counts], at least 1 counts; default 1000 counts
        @param amplitude_high see above [counts], at least 1 counts; default 8000 counts
        @param amplitude_percentile percentile of the pixels' amplitudes that is kept there, 1 to 99; default 90
        @param calibration auto_integration_time: a calibration of the kind integration-time: begins with the recommended time and stays within the range that was found suitable
        @param modulation_frequency default: the camera's own [Hz], at least 1 Hz
        @param frame_rate frame rate of simulations and of recordings without time stamps, and for the gap in the frame counter after an interruption; default: the profile's [Hz], 0.001 Hz to 1 MHz
        @param reconnect continues after a fault and when the camera comes back; frame_number has a gap; default false
        @param timeout time without a frame that counts as a fault [s], 50 ms to 3600 s; default 1 s
        @param phase_order the k of each image of the raw data, 0 to 3; default [3, 2, 1, 0]
        @param device usb: camera to open, by serial number or port, e.g. 1-2
        @param protocol usb: description of the camera's protocol; default: that of the project's software camera, not of a real CamCube
        @param library pmdsdk: path of libpmdaccess2.so; default: below $PMDDIR, /usr/local/pmd
        @param source_plugin pmdsdk: source plugin of the camera; camcube3 for a CamCube 2.0 or 3.0, camcube for 2; default camcube3
        @param source_parameter pmdsdk: parameter of the source plugin, e.g. a serial number
        @param processing_plugin pmdsdk: processing plugin of the camera; default camcubeproc
        @param processing_parameter pmdsdk: parameter of the processing plugin
        @param deliver pmdsdk: raw source data, or distance, amplitude, intensity and flags as the vendor's library computes them; default raw
        @param vendor_calibration pmdsdk: false switches the FPN, FPPN, linearity and lens calibrations off; default false
        @param roi pmdsdk: region of interest, px: [x, y, width, height]; the profile's size, at least 0
        @param exposure_mode pmdsdk: Normal, SMB or DoubleExposure, if the camera supports it
        @param commands pmdsdk: further commands, separated by ;, those to the processing plugin begin with 'processing ', e.g. 'SetSoftOffset 0; processing SetFOV 40'
        @param file replay: a capture (.h5) with taps or phases, or a raw dump
        @param pace replay: speed; default recorded
        @param loop replay: repeats the recording endlessly; default false
        @param scene simulated: the scene in front of the camera
        @param condition simulated: the only condition of the scene that is played, counted from 0; -1: all of them, one after the other, -1 to 1e+06; default -1
        """
    def capture_reader(self, *, name: str = ..., file: str | PathLike[str], channels: Any = ..., frames: Sequence[float | str] = ..., exposures: Literal["recording", "camera"] = ..., sources: Any = ..., **more: Any) -> Node:
        """Frames of a recording (HDF5).

        @param file a capture (.h5), or one that is still being recorded (.h5.part)
        @param channels channels to read, e.g. [range, amplitude]; default: all but a simulation's truth. Lengths come with their flags
        @param frames first and last, e.g. [0, 19]; default: all, at least 0
        @param exposures exposures to use: the recording's if it has its own, or those of the camera's profile; default recording
        @param sources the light sources that were on, e.g. left; default: as recorded, or all
        """
    def file_reader(self, *, name: str = ..., file: str | PathLike[str] = ..., files: Any = ..., layout: str | PathLike[str] = ..., unit: Any = ..., axes: Any = ..., invalid: Sequence[float | str] = ..., integration_time: str = ..., modulation_frequency: str = ..., frame_rate: str = ..., **more: Any) -> Node:
        """Reads files of other programs: arrays, pictures, tables, headerless dumps.

        @param file the file
        @param files instead of file, a series: a pattern with * and ?, relative to the working folder, or one name per line
        @param layout a layout file, which describes the arrays
        @param as the channel of the array, e.g. depth; of one of several arrays CHANNEL=ARRAY; several with commas
        @param unit unit of lengths: the length that a value of 1 stands for, e.g. mm or 0.25 mm
        @param axes axes of the array, slowest first, e.g. frame row column
        @param invalid values that mean no measurement; they apply to the lengths if there are any, e.g. [0, 65535]
        @param integration_time integration time of every frame [s], at least 0 s
        @param modulation_frequency modulation frequency of every frame; default: the profile's [Hz], at least 1 Hz
        @param frame_rate frame rate from which the time stamps follow [Hz], at least 1e-06 Hz
        """
    def pmd_raw_reader(self, *, name: str = ..., file: str | PathLike[str], frame_header: int = ..., phase_order: Sequence[float | str] = ..., integration_time: str = ..., modulation_frequency: str = ..., **more: Any) -> Node:
        """Reads a raw dump of a PMD camera: taps of four phase images.

        @param file the dump
        @param frame_header bytes before each frame that are skipped, 0 to 1.04858e+06; default 0
        @param phase_order the k of each image in the file, 0 to 3; default [3, 2, 1, 0]
        @param integration_time integration time of every frame; the dump does not state it [s], at least 0 s
        @param modulation_frequency modulation frequency of every frame; default: the profile's [Hz], at least 1 Hz
        """
    def simulator(self, *, name: str = ..., scene: str | PathLike[str] = ..., model: str | PathLike[str] = ..., distance: str = ..., reflectivity: float | str = ..., integration_time: str = ..., noise: Literal["profile", "none"] = ..., frames: int = ..., frame_rate: str = ..., seed: int = ..., output: Literal["phases", "taps", "distance"] = ..., truth: bool = ..., **more: Any) -> Node:
        """Simulated frames of a scene, or of a perpendicular board.

        @param scene a scene file; default: a board according to the parameters
        @param model a model file, light and effects; default: the scene's, or ideal
        @param distance distance of the board from the sensor plane [m], 1 mm to 1000 m; default 500 mm
        @param reflectivity reflectivity of the board, 0 to 1; default 0.85
        @param integration_time integration time of each phase image [s], 1 us to 10 s; default 1 ms
        @param noise profile: that of the camera's profile; default profile
        @param frames number of frames per condition; 0: endless; default: the scene's, at least 0; default 1
        @param frame_rate frame rate from which the time stamps follow; default: the camera's [Hz], 0.001 Hz to 1 MHz
        @param seed seed of the noise; default: the scene's, at least 0; default 1
        @param output output of the camera; default: the scene's, or phases
        @param truth adds true_depth and reflectivity, without any error; default false
        """
    def add_noise(self, *, name: str = ..., deviation: str, seed: int = ..., **more: Any) -> Node:
        """White Gaussian noise on a length, to test the following stages.

        @param deviation standard deviation of the noise, e.g. 10 mm [m], 0 m to 1000 m
        @param seed seed of the random numbers, at least 0; default 1
        """
    def average(self, *, name: str = ..., frames: int = ..., running: bool = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., **more: Any) -> Node:
        """Temporal mean over frames, valid pixels only, with the deviation of the mean.

        @param frames number of frames that are averaged into one, 1 to 1e+06; default 10
        @param running one mean for each incoming frame, over the last `frames`; default false
        @param channel channel to average; auto: the first of these that exists; default auto
        """
    def bilateral(self, *, name: str = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., strength: str = ..., sigma_adaptive: bool = ..., fill: bool = ..., window: int = ..., rho: str = ..., **more: Any) -> Node:
        """Averages each pixel with nearby pixels of similar length.

        @param channel channel to filter; auto: the first of these that exists; default auto
        @param strength h, the difference at which a weight is 1/e, e.g. 20 mm; auto: sqrt(2) times the median of the frame's sigma, equation (7.9) [m], at most 1000 m; default auto
        @param sigma_adaptive h of each pixel proportional to its sigma, equal to `strength` at the median sigma: the less light, the smoother; default false
        @param fill an invalid pixel takes the median of the filtered ones in its window, if at least half of the window is valid, and is flagged as filled; default false
        @param window side of the square window in pixels, odd, 1 to 63; default 7
        @param rho the distance in the image at which a weight is 1/e of that nearby [px], 0.1 px to 1e+06 px; default 5 px
        """
    def channels(self, *, name: str = ..., keep: Any = ..., drop: Any = ..., rename: Any = ..., **more: Any) -> Node:
        """Removes or renames channels.

        @param keep channels to keep, e.g. [depth, flags]; default: all
        @param drop channels to remove, e.g. [sigma]
        @param rename channels to rename: [old=new, ...], e.g. [distance=distance_short]
        """
    def crop(self, *, name: str = ..., columns: Sequence[float | str] = ..., rows: Sequence[float | str] = ..., minimum: str = ..., maximum: str = ..., minimum_amplitude: str = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., **more: Any) -> Node:
        """Cuts images to a region; marks lengths and amplitudes outside a range.

        @param columns first and last, from 0, both kept; default: all, at least 0
        @param rows first and last, from 0, both kept; default: all, at least 0
        @param minimum shorter lengths are marked invalid [m]
        @param maximum longer lengths are marked invalid [m]
        @param minimum_amplitude pixels with a smaller amplitude are marked invalid [counts], at least 0 counts
        @param channel the length that minimum and maximum refer to; auto: the first of these that exists; default auto
        """
    def flying_pixels(self, *, name: str = ..., threshold: str = ..., deviations: float | str = ..., grazing: str = ..., invalidate: bool = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., **more: Any) -> Node:
        """Marks mixed pixels: lengths between the two sides of a depth edge.

        @param threshold minimum step to each side [m], 0 m to 1000 m; default 20 mm
        @param deviations minimum step to each side in units of the pixel's sigma; without sigma, of the frame's own noise around the pixel, 0 to 1000; default 5
        @param grazing surfaces seen at a less grazing angle than this are never marked; 0 deg: no limit [rad], 0 rad to 1.56 rad; default 80 deg
        @param invalidate marked pixels become invalid, in all lengths; default false
        @param channel channel in which edges are searched; auto: the first of these that exists; default auto
        """
    def four_phase_decoder(self, *, name: str = ..., modulation_frequency: str = ..., min_amplitude: str = ..., invalidate_low_signal: bool = ..., invalidate_saturated: bool = ..., invalidate_inconsistent: bool = ..., calibration: str | PathLike[str] = ..., read_noise: str = ..., shot_noise: str = ..., other_serial: bool = ..., full_well: str = ..., inconsistent_above: str = ..., **more: Any) -> Node:
        """Distance, amplitude, intensity, sigma and flags from four-phase samples.

        @param modulation_frequency replaces the frames' own frequency, e.g. 20 MHz [Hz], 1 kHz to 10 GHz
        @param min_amplitude a smaller amplitude is flagged as low signal [counts], at least 0 counts; default 0 counts
        @param invalidate_low_signal pixels of low signal become invalid; default false
        @param invalidate_saturated saturated pixels become invalid; default true
        @param invalidate_inconsistent pixels whose samples or frequencies do not fit each other become invalid; default false
        @param calibration a calibration file of the kind noise; default: the camera's noise
        @param read_noise read noise of a tap; default: the calibration's, or the camera's [counts], at least 0 counts
        @param shot_noise variance of a tap per count; default: the calibration's, or the camera's [counts], at least 0 counts
        @param other_serial true: a calibration of a device with another serial number is used, with a warning; default false
        @param full_well a tap that reaches it is saturated; default: the camera's, or 65535 [counts], at least 0 counts
        @param inconsistent_above flags |N2| = |c0 - c1 + c2 - c3| / 4 above this as inconsistent; auto: five standard deviations where the noise is known, else off [counts], at least 0 counts; default auto
        """
    def hdr_fusion(self, *, name: str = ..., frames: int = ..., by: Literal["integration_time", "frequency"] = ..., max_range: str = ..., channel: Literal["auto", "distance", "range", "depth"] = ..., **more: Any) -> Node:
        """Joins frames of alternating integration times or modulation frequencies.

        @param frames integration times or frequencies of the bracket, 2 to 64; default 2
        @param by the setting that alternates; frequency: distances are unwrapped; default integration_time
        @param max_range by frequency: maximum distance; default: the distance at which the frequencies repeat together [m], 1 mm to 1e+06 m
        @param channel channel to fuse; auto: the first of these that exists; default auto
        """
    def intrinsics(self, *, name: str = ..., calibration: str | PathLike[str] = ..., fx: str = ..., fy: str = ..., cx: str = ..., cy: str = ..., lens: Literal["opencv", "fisheye"] = ..., k1: float | str = ..., k2: float | str = ..., p1: float | str = ..., p2: float | str = ..., k3: float | str = ..., k4: float | str = ..., k5: float | str = ..., k6: float | str = ..., skew: float | str = ..., rectify: bool = ..., other_serial: bool = ..., **more: Any) -> Node:
        """Replaces the camera's lens and with it each pixel's ray; rectifies images.

        @param calibration a calibration file of the kind intrinsics
        @param fx focal length in x [px], at least 0.001 px
        @param fy focal length in y [px], at least 0.001 px
        @param cx principal point in x, a pixel's centre at integers from 0 [px]
        @param cy principal point in y, a pixel's centre at integers from 0 [px]
        @param lens model of the distortion; fisheye: k1 to k4 of OpenCV's fisheye module; default: the camera's
        @param k1 radial distortion, OpenCV's model
        @param k2 radial distortion, OpenCV's model
        @param p1 tangential distortion, OpenCV's model
        @param p2 tangential distortion, OpenCV's model
        @param k3 radial distortion, OpenCV's model
        @param k4 denominator of the radial distortion, OpenCV's rational model; of a fisheye its fourth
        @param k5 denominator of the radial distortion, OpenCV's rational model
        @param k6 denominator of the radial distortion, OpenCV's rational model
        @param skew skew of the axes: u = fx (x + skew y) + cx
        @param rectify resamples the images: the outgoing camera has no distortion; default false
        @param other_serial true: a calibration of a device with another serial number is used, with a warning; default false
        """
    def mask(self, *, name: str = ..., min_amplitude: str = ..., max_amplitude: str = ..., max_sigma: str = ..., max_null2: float | str = ..., bad_pixels: Any = ..., polygon: Sequence[float | str] = ..., image: Any = ..., keep: Literal["inside", "outside"] = ..., codes: Sequence[float | str] = ..., codes_of: Any = ..., flagged: Any = ..., invalidate: bool = ..., **more: Any) -> Node:
        """Masks pixels by amplitude, sigma, null channel, place, codes or flags.

        @param min_amplitude a smaller amplitude is flagged as low_signal, e.g. 50 counts [counts], at least 0 counts
        @param max_amplitude a larger amplitude is flagged as saturated, e.g. 20000 counts [counts], at least 0 counts
        @param max_sigma a larger standard deviation is flagged as low_signal [m], at least 0 m
        @param max_null2 a larger |N2| = |c0 - c1 + c2 - c3| / 4 relative to the amplitude is flagged as inconsistent, e.g. 5 %, at least 0
        @param bad_pixels pixels where this is not 0 are flagged as bad_pixel: {file, dataset}, as tofgraph calibrate noise writes it (dataset: bad)
        @param polygon corners x1, y1, x2, y2, ... in pixels from 0, e.g. [20, 10, 180, 10, 180, 150]; pixels whose centre is outside are masked
        @param image pixels where this is 0 are masked: a picture, an array or {file, dataset}
        @param keep outside: polygon and image are the region that is masked; default inside
        @param codes pixels with one of these values are masked, in the unit of the channel, e.g. [0, 65.535]
        @param codes_of the channel that has the codes, e.g. amplitude; of several images one is enough; default: the length
        @param flagged pixels with one of these flags are masked too, e.g. [saturated, wrapped, extrapolated]
        @param invalidate false: pixels are only flagged; default true
        """
    def median(self, *, name: str = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., window: int = ..., fill: bool = ..., **more: Any) -> Node:
        """The median of each pixel's window, valid pixels only.

        @param channel channel to filter; auto: the first of these that exists; default auto
        @param window side of the square window in pixels, odd, 1 to 63; default 3
        @param fill an invalid pixel takes the median of the filtered ones in its window, if at least half of the window is valid, and is flagged as filled; default false
        """
    def model_correction(self, *, name: str = ..., model: str | PathLike[str] = ..., other_serial: bool = ..., **more: Any) -> Node:
        """Undoes the effects of a model on the distance.

        @param model a model file, written by diagnose, calibrate or by hand, or its content; default: the profile's
        @param other_serial true: a calibration of a device with another serial number is used, with a warning; default false
        """
    def noise_model(self, *, name: str = ..., mode: Literal["profile", "null_channel", "frames", "spatial"], calibration: str | PathLike[str] = ..., read_noise: str = ..., shot_noise: str = ..., other_serial: bool = ..., contrast: float | str = ..., background: str = ..., channel: Literal["auto", "distance", "range", "depth"] = ..., **more: Any) -> Node:
        """Standard deviation of lengths, by the camera's noise or from the recording itself.

        @param mode profile: by the camera's read_noise, shot_noise and contrast; the others estimate it: from the raw images of a frame, from repeated frames, from one frame
        @param calibration a calibration file of the kind noise; default: the camera's noise
        @param read_noise read noise of a tap; default: the calibration's, or the camera's [counts], at least 0 counts
        @param shot_noise variance of a tap per count; default: the calibration's, or the camera's [counts], at least 0 counts
        @param other_serial true: a calibration of a device with another serial number is used, with a warning; default false
        @param contrast for profile, if the input has no intensity; default: the camera's, 0.001 to 1
        @param background for profile: ambient light and dark current of a tap [counts/s], at least 0 counts/s; default 0 counts/s
        @param channel channel whose sigma is computed; auto: the first of these that exists; default auto
        """
    def non_local_means(self, *, name: str = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., strength: str = ..., sigma_adaptive: bool = ..., fill: bool = ..., search: int = ..., patch: int = ..., patch_weights: Literal["gaussian", "uniform", "robust"] = ..., patch_sigma: str = ..., guide: Literal["none", "amplitude"] = ..., **more: Any) -> Node:
        """Averages each pixel with nearby pixels whose surroundings are similar.

        @param channel channel to filter; auto: the first of these that exists; default auto
        @param strength h, the difference at which a weight is 1/e, e.g. 20 mm; auto: sqrt(2) times the median of the frame's sigma, equation (7.9) [m], at most 1000 m; default auto
        @param sigma_adaptive h of each pixel proportional to its sigma, equal to `strength` at the median sigma: the less light, the smoother; default false
        @param fill an invalid pixel takes the median of the filtered ones in its window, if at least half of the window is valid, and is flagged as filled; default false
        @param search side of the square window in pixels, odd, 1 to 63; default 7
        @param patch side of the patches in pixels, odd, at most `search`, 1 to 21; default 3
        @param patch_weights weights of a patch's pixels; robust: pixels across an edge count less, in a time that grows with the square of the side; default gaussian
        @param patch_sigma a, the width of the patch's Gaussian [px], 0.1 px to 1000 px; default 1 px
        @param guide amplitude: patches must also agree in amplitude, as far as its noise allows; default none
        """
    def normals(self, *, name: str = ..., neighbours: int = ..., radius: str = ..., viewpoint: Sequence[float | str] = ..., **more: Any) -> Node:
        """Normal and curvature of the surface at each point.

        @param neighbours number of nearest points, the point itself included, 3 to 10000; default 20
        @param radius uses all points within this radius, instead of neighbours [m], 1 um to 1000 m
        @param viewpoint position of the camera in the frame of the points [m]; default [0 m, 0 m, 0 m]
        """
    def offset_correction(self, *, name: str = ..., calibration: str | PathLike[str], method: Literal["per_pixel", "per_path", "board"] = ..., target: Any = ..., window: int = ..., extrapolation: Literal["flag", "refuse", "hold"] = ..., keep_offset: bool = ..., serial: Any = ..., other_serial: bool = ..., **more: Any) -> Node:
        """Removes the offset by integration time and reflectivity, from a calibration of boards.

        @param calibration a calibration file of the kind offset, see calibrate offset
        @param method per_pixel: any scene, by depth and reflectivity; per_path: by range and light, as a camera errs, for boards that are close together; board: one offset matrix for one board that fills the image; default per_pixel
        @param target the calibration's target that matches all surfaces; default: found by amplitude
        @param window side in pixels of the square over which depth and reflectivity are averaged before they are looked up, odd; 1: not averaged, the offset then adds noise, 1 to 15; default 5
        @param extrapolation outside the calibrated range; flag: the nearest offset, flagged as extrapolated; refuse: the pixel becomes invalid; hold: not flagged; default flag
        @param keep_offset writes the image `offset` of the added offset, (6.5); default false
        @param serial the camera's serial number, compared with the calibration's; default: the recording's
        @param other_serial true: a calibration of a device with another serial number is used, with a warning; default false
        """
    def optimized_bistatic(self, *, name: str = ..., solver: Literal["newton", "bisection"] = ..., **more: Any) -> Node:
        """Distance to depth by the optimized bistatic model, for any sources anywhere.

        @param solver newton: with Newton steps only where a corrected closed form is not exact enough; bisection: the slow reference in double precision; default newton
        """
    def orient(self, *, name: str = ..., mirror: Literal["none", "left_right", "top_bottom"] = ..., turn: Literal[0, 90, 180, 270] = ..., camera: Literal["turned", "kept"] = ..., **more: Any) -> Node:
        """Mirrors and turns images together with the lens and the light sources.

        @param mirror sides that are exchanged, before the turn; default none
        @param turn degrees clockwise; default 0
        @param camera turned: lens and sources follow; kept: the profile is right, the images are not; default turned
        """
    def perpendicular_illumination(self, *, name: str = ..., **more: Any) -> Node:
        """Distance to depth as if the light came from behind every point.
        """
    def phase_decoder(self, *, name: str = ..., modulation_frequency: str = ..., min_amplitude: str = ..., invalidate_low_signal: bool = ..., invalidate_saturated: bool = ..., invalidate_inconsistent: bool = ..., calibration: str | PathLike[str] = ..., read_noise: str = ..., shot_noise: str = ..., other_serial: bool = ..., full_well: str = ..., inconsistent_above: float | str = ..., wrap_confidence: float | str = ..., invalidate_wrapped: bool = ..., phase_error: str = ..., max_range: str = ..., **more: Any) -> Node:
        """Distance, amplitude, intensity, sigma and flags from any exposures, unwrapped.

        @param modulation_frequency replaces the frames' own frequency, e.g. 20 MHz [Hz], 1 kHz to 10 GHz
        @param min_amplitude a smaller amplitude is flagged as low signal [counts], at least 0 counts; default 0 counts
        @param invalidate_low_signal pixels of low signal become invalid; default false
        @param invalidate_saturated saturated pixels become invalid; default true
        @param invalidate_inconsistent pixels whose samples or frequencies do not fit each other become invalid; default false
        @param calibration a calibration file of the kind noise; default: the camera's noise
        @param read_noise read noise of a tap; default: the calibration's, or the camera's [counts], at least 0 counts
        @param shot_noise variance of a tap per count; default: the calibration's, or the camera's [counts], at least 0 counts
        @param other_serial true: a calibration of a device with another serial number is used, with a warning; default false
        @param full_well a tap that reaches it is saturated; default: the camera's, or 65535 [counts], at least 0 counts
        @param inconsistent_above in standard deviations: samples or frequencies that differ by more are flagged as inconsistent; where the noise is known, at least 0; default 5
        @param wrap_confidence confidence of the best wraps over the second best; a smaller one is flagged as wrapped; if the noise is known, 0.5 to 0.999999; default 0.999
        @param invalidate_wrapped pixels whose wraps are uncertain become invalid; default true
        @param phase_error standard deviation of systematic errors of each frequency's phase, which the choice of the wraps allows for; not included in sigma [rad], 0 rad to 1 rad; default 0 rad
        @param max_range maximum distance; default: the distance at which the frequencies repeat together, c / (2 gcd) [m], 1 mm to 1e+06 m
        """
    def point_cloud(self, *, name: str = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., assume: Literal["range", "lens_depth"] = ..., **more: Any) -> Node:
        """Depth or range to points in the optical frame.

        @param channel auto: the first of depth, range, distance that exists; default auto
        @param assume range: 'distance' already is a straight distance from the lens centre; without this distances are refused. lens_depth: 'depth' counts from the lens centre, as in ROS and OpenCV, not from the sensor plane
        """
    def simple_bistatic(self, *, name: str = ..., plane_depth: str = ..., **more: Any) -> Node:
        """Distance to depth with the sources' angles for a plane, given or estimated.

        @param plane_depth distance of the plane from the sensor plane; auto: estimated from the frame [m], 20 mm to 1000 m; default auto
        """
    def statistical_outlier_removal(self, *, name: str = ..., neighbours: int = ..., deviations: float | str = ..., **more: Any) -> Node:
        """Marks points that are far from their neighbours as invalid.

        @param neighbours number of neighbours whose mean distance is examined, 1 to 10000; default 20
        @param deviations number of standard deviations above the mean that is still accepted, 0 to 100; default 2
        """
    def temporal_kalman(self, *, name: str = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., measurement_noise: str = ..., process_noise: str = ..., gate: float | str = ..., **more: Any) -> Node:
        """Follows each pixel from frame to frame, restarting where it moves.

        @param channel channel to filter; auto: the first of these that exists; default auto
        @param measurement_noise standard deviation of a measurement, e.g. 5 mm; default: the frame's sigma [m], 1 um to 1000 m
        @param process_noise standard deviation of a pixel's change from frame to frame [m], 0 m to 1000 m; default 0.5 mm
        @param gate number of standard deviations beyond which a pixel counts as moved and is restarted, 1 to 100; default 4
        """
    def transform(self, *, name: str = ..., rotation: Sequence[float | str] = ..., angles: Sequence[float | str] = ..., translation: Sequence[float | str] = ..., shift: Sequence[float | str] = ..., pose: str | PathLike[str] = ..., **more: Any) -> Node:
        """Moves the points into another frame: p_world = T_world_camera p_camera.

        @param rotation R of T_world_camera, row by row; default [1, 0, 0, 0, 1, 0, 0, 0, 1]
        @param angles instead of rotation: turns about x, then y, then z [rad]; default [0 deg, 0 deg, 0 deg]
        @param translation t of T_world_camera [m]; default [0 mm, 0 mm, 0 mm]
        @param shift subtracted from the moved points in double precision, e.g. [500000 m, 5400000 m, 0 m]; the output is relative to it, and so is a viewpoint [m]; default [0 m, 0 m, 0 m]
        @param pose instead of both: T_world_camera as found by tofgraph pose; the world is the pattern's frame
        """
    def voxel_grid(self, *, name: str = ..., size: str = ..., least: int = ..., **more: Any) -> Node:
        """One point per voxel: the centroid, with the means of its channels.

        @param size edge of a voxel [m], 1 um to 1000 m; default 20 mm
        @param least voxels with fewer points are omitted, 1 to 1e+06; default 1
        """
    def yaroslavsky(self, *, name: str = ..., channel: Literal["auto", "depth", "range", "distance"] = ..., strength: str = ..., sigma_adaptive: bool = ..., fill: bool = ..., window: int = ..., **more: Any) -> Node:
        """Averages each pixel with the pixels of its window that have a similar length.

        @param channel channel to filter; auto: the first of these that exists; default auto
        @param strength h, the difference at which a weight is 1/e, e.g. 20 mm; auto: sqrt(2) times the median of the frame's sigma, equation (7.9) [m], at most 1000 m; default auto
        @param sigma_adaptive h of each pixel proportional to its sigma, equal to `strength` at the median sigma: the less light, the smoother; default false
        @param fill an invalid pixel takes the median of the filtered ones in its window, if at least half of the window is valid, and is flagged as filled; default false
        @param window side of the square window in pixels, odd, 1 to 63; default 7
        """
    def capture_writer(self, *, name: str = ..., path: str | PathLike[str], channels: Any = ..., compression: int = ..., comment: Any = ..., sources: Any = ..., write_behind: int = ..., **more: Any) -> Node:
        """Records its input as a capture (HDF5).

        @param path the capture, e.g. out/scene.h5
        @param channels channels to record, e.g. [distance, amplitude]; default: all
        @param compression 0: none, 1: fast, 9: small, 0 to 9; default 0
        @param comment kept in the capture
        @param sources the light sources that were on, kept in the capture; default: those of the input's camera
        @param write_behind MB of frames that may wait for a slow disk; then the source has to wait, or a live one to drop frames. 0: one frame, 0 to 65536; default 256
        """
    def image_writer(self, *, name: str = ..., channel: Any = ..., path: Any, minimum: str = ..., maximum: str = ..., format: Literal["auto", "color", "uint16", "float32"] = ..., scale: str = ..., zoom: int = ..., **more: Any) -> Node:
        """A channel as pictures: false colours, 16-bit counts, 32-bit floats.

        @param channel the image; default: the first of depth, range, distance, amplitude, intensity that exists
        @param path the files, e.g. out/range_{frame:06}.png; {frame} is the number
        @param minimum lower end of the colours; auto: 1 % of the frame's valid pixels are below [m|counts|1]; default auto
        @param maximum upper end of the colours; auto: 1 % are above [m|counts|1]; default auto
        @param format auto: .png color, .tif float32; default auto
        @param scale value of one count of uint16; default: 1 mm, 1 counts or 1 [m|counts|1], at least 0.001 um
        @param zoom magnification of the colour picture; default: such that it has 400 rows, 1 to 64
        """
    def live_view(self, *, name: str = ..., port: int = ..., address: Any = ..., origins: Any = ..., clients: int = ..., rate: str = ..., pace: str = ..., wait: bool = ..., hold: bool = ..., **more: Any) -> Node:
        """Shows the frames in a web browser while the pipeline runs.

        @param port TCP port; 0: any free one, 0 to 65535; default 8765
        @param address address to listen on; other computers reach the view with 0.0.0.0 and the token that is then printed; default 127.0.0.1
        @param origins web pages elsewhere that may connect, e.g. [https://app.foxglove.dev]
        @param clients more are refused, 1 to 48; default 16
        @param rate frames per second that a client gets at most [Hz], 0.1 Hz to 1 kHz; default 60 Hz
        @param pace limits the frame rate of the pipeline, e.g. 30 Hz for a recording [Hz], 0.01 Hz to 10 kHz
        @param wait the first frame waits for a client, each further one at most 1 s until a client is ready: for recordings, if no frame may be missed; default false
        @param hold after the last frame the view stays open until Ctrl-C, or until all clients have left; default false
        """
    def mcap_writer(self, *, name: str = ..., path: str | PathLike[str], topics: Any = ..., frame_id: Any = ..., compression: Literal["none", "lz4", "zstd"] = ..., **more: Any) -> Node:
        """Recordings in MCAP for viewers of ROS 2: images, clouds, the camera.

        @param path the recording, e.g. out/drive.mcap
        @param topics prefix of the topics: this with /depth, /points, /camera_info, ..; default /camera
        @param frame_id frame_id of the headers; default camera_optical_frame
        @param compression compression of the chunks, one per frame; default zstd
        """
    def npy_writer(self, *, name: str = ..., path: str | PathLike[str], channel: Any, **more: Any) -> Node:
        """A channel of all frames as one array of NumPy.

        @param path the array, e.g. out/depth.npy
        @param channel channel to write, e.g. depth
        """
    def null(self, *, name: str = ..., **more: Any) -> Node:
        """Accepts frames and does nothing with them.
        """
    def pcd_writer(self, *, name: str = ..., path: Any, dense: bool = ..., intensity: Any = ..., sigma: bool = ..., flags: bool = ..., normals: bool = ..., encoding: Literal["ascii", "binary", "binary_compressed"] = ..., viewpoint: Sequence[float | str] = ..., **more: Any) -> Node:
        """Point clouds as PCD files, one per frame.

        @param path the files, e.g. out/cloud_{frame:06}.pcd; {frame} is the number. Next to them: out/cloud.provenance.json
        @param dense valid points only, without the image's rows; default false
        @param intensity the channel for the field intensity, or none; default: amplitude if it exists; default amplitude
        @param sigma with the field sigma; default false
        @param flags with the field flags; default false
        @param normals with the fields normal_x, normal_y, normal_z and curvature, see the filter normals; default false
        @param encoding encoding of the values; default binary
        @param viewpoint pose of the camera in the frame of the points: x y z in metres, quaternion w x y z; default: the optical centre; required after transform; default [0, 0, 0, 1, 0, 0, 0]
        """
    def ply_writer(self, *, name: str = ..., path: Any, dense: bool = ..., intensity: Any = ..., sigma: bool = ..., flags: bool = ..., normals: bool = ..., encoding: Literal["ascii", "binary"] = ..., **more: Any) -> Node:
        """Point clouds as PLY files, one per frame.

        @param path the files, e.g. out/cloud_{frame:06}.pcd; {frame} is the number. Next to them: out/cloud.provenance.json
        @param dense valid points only, without the image's rows; default true
        @param intensity the channel for the field intensity, or none; default: amplitude if it exists; default amplitude
        @param sigma with the field sigma; default false
        @param flags with the field flags; default false
        @param normals with the fields normal_x, normal_y, normal_z and curvature, see the filter normals; default false
        @param encoding encoding of the values; default binary
        """
    def statistics(self, *, name: str = ..., channel: Any = ..., columns: Sequence[float | str] = ..., rows: Sequence[float | str] = ..., value: str = ..., reference: Any = ..., part: Literal["all", "flat", "edge", "each"] = ..., path: str | PathLike[str] = ..., show: bool = ..., format: Literal["auto", "table", "csv", "json"] = ..., **more: Any) -> Node:
        """Mean, standard deviation and rms of an image over a region: lengths, or any other channel.

        @param channel any image of float32, e.g. amplitude; default: the first of depth, range, distance that exists
        @param columns first and last, e.g. [90, 113]; default: all, at least 0
        @param rows first and last; default: all, at least 0
        @param value the value to which rms refers; default for lengths: a fitted plane [m|counts|1]
        @param reference a channel to which rms refers, pixel by pixel, e.g. true_depth of a simulation
        @param part pixels to evaluate: edge, those within 3 pixels of a step of more than 30 mm between neighbours in the reference; flat, the others; each, all of them side by side; default all
        @param path a .csv or .json file; default: standard output
        @param show also prints the table on standard output if path names a file; default false
        @param format auto: by the file's name; a table on standard output; default auto
        """
    def surface_writer(self, *, name: str = ..., channel: Any = ..., path: Any, minimum: str = ..., maximum: str = ..., azimuth: str = ..., elevation: str = ..., size: int = ..., **more: Any) -> Node:
        """A channel as a surface in space, as pictures.

        @param channel the image; default: the first of depth, range, distance, amplitude, intensity that exists
        @param path the files, e.g. out/range_{frame:06}.png; {frame} is the number
        @param minimum lower end of the colours; auto: 1 % of the frame's valid pixels are below [m|counts|1]; default auto
        @param maximum upper end of the colours; auto: 1 % are above [m|counts|1]; default auto
        @param azimuth turn of the viewer about the viewing axis, from the middle of the last row; positive: to the right [rad], -3.14159 rad to 3.14159 rad; default -35 deg
        @param elevation elevation of the viewer above the image plane [rad], 50 mrad to 1.5 rad; default 40 deg
        @param size width of the picture in pixels, 300 to 8000; default 720
        """
    def __getattr__(self, name: str) -> Callable[..., Node]:
        """Returns a stage of another plugin."""

stage: Stages

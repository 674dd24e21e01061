// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Outputs and parameters of the stage `camcube`.
#pragma once

#include <tofgraph/stage.hpp>

namespace tofgraph {

struct CamCubeParameters : Source {
  Out<std::uint16_t> taps{this, "taps", {.optional = true}};
  Out<std::uint8_t> headers{this,
                            "raw_headers",
                            {.shape = "4 512",
                             .unit = "",
                             .optional = true,
                             .text = "the 512 bytes before each phase image, as they are: not interpreted"}};
  Out<float> distance{this, "distance", {.optional = true, .text = "deliver: images: as the vendor computes it"}};
  Out<float> amplitude{this, "amplitude", {.optional = true}};
  Out<float> intensity{this, "intensity", {.optional = true}};
  Out<std::uint16_t> flags{this, "flags", {.optional = true}};

  Param<Choice> backend{this,
                        "backend",
                        {.default_value = "auto",
                         .choices = "auto pmdsdk usb replay simulated",
                         .text = "auto: the one that a given parameter is of (file, scene, library, device), else the "
                                 "first of pmdsdk (the vendor's library) and usb that finds a camera; these two are "
                                 "not verified on hardware"}};
  Param<double> integration_time{
      this, "integration_time", {.unit = "s", .min = 0, .text = "of each phase image; default: the camera's own"}};
  Param<bool> auto_integration_time{
      this,
      "auto_integration_time",
      {.default_value = "false",
       .text = "keeps the amplitude between amplitude_low and amplitude_high by changing the integration time from "
               "frame to frame, from integration_time on; never into saturation"}};
  Param<double> amplitude_low{
      this, "amplitude_low", {.unit = "counts", .default_value = "1000 counts", .min = 1, .text = "see above"}};
  Param<double> amplitude_high{
      this, "amplitude_high", {.unit = "counts", .default_value = "8000 counts", .min = 1, .text = "see above"}};
  Param<double> amplitude_percentile{
      this,
      "amplitude_percentile",
      {.default_value = "90", .min = 1, .max = 99, .text = "of the pixels' amplitudes, which one is kept there"}};
  Param<InputFile> calibration{
      this,
      "calibration",
      {.text = "auto_integration_time: of the kind integration-time: begins with the recommended time and stays within "
               "the times that were found good"}};
  Param<double> modulation_frequency{
      this, "modulation_frequency", {.unit = "Hz", .min = 1, .text = "default: the camera's own"}};
  Param<double> frame_rate{this,
                           "frame_rate",
                           {.unit = "Hz",
                            .min = 1e-3,
                            .max = 1e6,
                            .text = "of simulations and of recordings without time stamps, and for the gap in the "
                                    "frame counter after an interruption; default: the profile's"}};
  Param<bool> reconnect{this,
                        "reconnect",
                        {.default_value = "false",
                         .text = "goes on after a fault and when the camera comes back; frame_number has a gap"}};
  Param<double> timeout{this,
                        "timeout",
                        {.unit = "s",
                         .default_value = "1 s",
                         .min = 0.05,
                         .max = 3600,
                         .text = "without a frame for so long is a fault"}};
  Param<std::vector<double>> phase_order{
      this,
      "phase_order",
      {.default_value = "[3, 2, 1, 0]", .min = 0, .max = 3, .text = "the k of each image of the raw data"}};
  Param<std::string> device{this, "device", {.text = "usb: which camera, by serial number or port, e.g. 1-2"}};
  Param<InputFile> protocol{
      this,
      "protocol",
      {.text = "usb: how the camera speaks; default: the project's software camera, no real CamCube"}};
  Param<InputFile> library{
      this, "library", {.text = "pmdsdk: path of libpmdaccess2.so; default: below $PMDDIR, /usr/local/pmd"}};
  Param<std::string> source_plugin{
      this,
      "source_plugin",
      {.default_value = "camcube3", .text = "pmdsdk: of the camera; camcube3 for a CamCube 2.0 or 3.0, camcube for 2"}};
  Param<std::string> source_parameter{
      this, "source_parameter", {.text = "pmdsdk: what the source plugin is given, e.g. a serial number"}};
  Param<std::string> processing_plugin{
      this, "processing_plugin", {.default_value = "camcubeproc", .text = "pmdsdk: of the camera"}};
  Param<std::string> processing_parameter{
      this, "processing_parameter", {.text = "pmdsdk: what the processing plugin is given"}};
  Param<Choice> deliver{this,
                        "deliver",
                        {.default_value = "raw",
                         .choices = "raw images",
                         .text = "pmdsdk: raw source data, or distance, amplitude, intensity and flags as the "
                                 "vendor's library computes them"}};
  Param<bool> vendor_calibration{
      this,
      "vendor_calibration",
      {.default_value = "false", .text = "pmdsdk: false switches the FPN, FPPN, linearity and lens calibrations off"}};
  Param<std::vector<double>> roi{
      this, "roi", {.min = 0, .text = "pmdsdk: region of interest, px: [x, y, width, height]; the profile's size"}};
  Param<std::string> exposure_mode{
      this, "exposure_mode", {.text = "pmdsdk: Normal, SMB or DoubleExposure, as the camera knows"}};
  Param<std::string> commands{this,
                              "commands",
                              {.text = "pmdsdk: further commands, separated by ;, those to the processing plugin "
                                       "begin with 'processing ', e.g. 'SetSoftOffset 0; processing SetFOV 40'"}};
  Param<InputFile> file{this, "file", {.text = "replay: a capture (.h5) with taps or phases, or a raw dump"}};
  Param<Choice> pace{
      this, "pace", {.default_value = "recorded", .choices = "recorded fast", .text = "replay: how fast"}};
  Param<bool> loop{this, "loop", {.default_value = "false", .text = "replay: again and again"}};
  Param<InputFile> scene{this, "scene", {.text = "simulated: what the camera looks at"}};
  Param<std::int64_t> condition{this,
                                "condition",
                                {.default_value = "-1",
                                 .min = -1,
                                 .max = 1000000,
                                 .text = "simulated: the only condition of the scene that is played, counted from 0; "
                                         "-1: all of them, one after the other"}};
};

}  // namespace tofgraph

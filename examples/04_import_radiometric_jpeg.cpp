// SPDX-License-Identifier: BSD-3-Clause
// 04_import_radiometric_jpeg photo.jpg: the hottest temperature in a FLIR radiometric JPEG.
#include <cmath>
#include <iostream>
#include <orbitfuse/core/system/file_io.hpp>
#include <orbitfuse/drivers/stills/flir_jpeg.hpp>

namespace of = orbitfuse;

of::Result<double> hottest_kelvin(const char* file) {
  ORBITFUSE_ASSIGN(const std::string bytes, of::read_file(file));
  ORBITFUSE_ASSIGN(const of::FlirImage image, of::read_flir_jpeg(bytes, file));
  ORBITFUSE_TRY(image.calibration.validate(file));
  // A pixel's temperature follows from its raw signal by the camera's own calibration and the
  // emissivity, distance and air that the operator set in the camera.
  const of::FlirThermometer thermometer(image.calibration);
  double hottest = std::nan("");
  for (const std::uint16_t signal : cv::Mat_<std::uint16_t>(image.signal))
    // At the ends of the camera's range a signal says "that or more": it is no temperature.
    if (signal > image.lowest_signal && signal < image.highest_signal)
      hottest = std::fmax(hottest, thermometer.kelvin(signal));
  if (std::isnan(hottest))
    return of::fail(of::ErrorKind::input, file, "no sample in range", "choose another range");
  return hottest;
}

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: 04_import_radiometric_jpeg photo.jpg\n";
    return 2;
  }
  const of::Result<double> hottest = hottest_kelvin(argv[1]);
  if (!hottest) {
    std::cerr << hottest.error().message() << "\n";
    return 1;
  }
  std::cout << *hottest << " K\n";
}

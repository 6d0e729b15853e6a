#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what OrbitFuse builds and runs with, and the packages named as arguments, from Debian 12;
# does nothing when all are here.
set -euo pipefail

packages=(
  g++ cmake ninja-build pkg-config git python3
  libeigen3-dev libceres-dev libopencv-dev libtbb-dev
  libcli11-dev nlohmann-json3-dev libtomlplusplus-dev libexpected-dev libfmt-dev libspdlog-dev
  libtiff-dev libpng-dev libjpeg-dev libcharls-dev libheif-dev libexiv2-dev libsqlite3-dev libxxhash-dev libnanoflann-dev
  libaravis-dev libusb-1.0-0-dev libopencv-contrib-dev libcpp-httplib-dev libhpdf-dev libjs-three libmeshoptimizer-dev libtinygltf-dev
  libgtest-dev libgmock-dev libbenchmark-dev
  colmap
  "$@"
)

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" apt-get install -y --no-install-recommends "${missing[@]}"

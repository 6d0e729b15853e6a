// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Arithmetic that a CUDA device does as the processor does: nvcc compiles it for both, g++ reads
/// over the word.
#ifdef __CUDACC__
#define ORBITFUSE_HOST_DEVICE __host__ __device__
#else
#define ORBITFUSE_HOST_DEVICE
#endif

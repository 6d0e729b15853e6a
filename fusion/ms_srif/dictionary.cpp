// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/ms_srif/dictionary.hpp"

#include <cassert>
#include <cmath>
#include <string>
#include <vector>

namespace orbitfuse::embedded {
extern const std::string_view ms_srif_dictionary;
}

namespace orbitfuse::fusion {

Result<Dictionary> Dictionary::from_atoms(const Eigen::MatrixXf& atoms) {
  const auto bad = [](const std::string& found) {
    return fail(ErrorKind::input, "dictionary", found, "train it anew with train_dictionary");
  };
  if (atoms.rows() != patch_size)
    return bad(std::to_string(atoms.rows()) + " samples an atom, not 64");
  if (!atoms.allFinite()) return bad("samples that are not finite");
  std::vector<Eigen::VectorXf> kept;
  for (Eigen::Index i = 0; i < atoms.cols(); ++i) {
    Eigen::VectorXf atom = atoms.col(i).array() - atoms.col(i).mean();
    const float length = atom.stableNorm();
    if (!(length > 1e-6F * std::max(1.0F, atoms.col(i).stableNorm()))) continue;
    atom /= length;
    bool repeated = false;
    for (const Eigen::VectorXf& other : kept)
      repeated = repeated || std::abs(other.dot(atom)) > 1 - 1e-5F;
    if (!repeated) kept.push_back(std::move(atom));
  }
  if (kept.empty()) return bad("no atom with any contrast");
  Dictionary dictionary;
  dictionary.atoms_.resize(patch_size, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i)
    dictionary.atoms_.col(static_cast<Eigen::Index>(i)) = kept[i];
  dictionary.gram_ = dictionary.atoms_.transpose() * dictionary.atoms_;
  return dictionary;
}

Result<Dictionary> Dictionary::from_bytes(std::string_view bytes) {
  if (bytes.empty() || bytes.size() % patch_size != 0)
    return fail(ErrorKind::input, "dictionary",
                std::to_string(bytes.size()) + " bytes, not a multiple of 64",
                "train it anew with train_dictionary");
  Eigen::MatrixXf atoms(patch_size, static_cast<Eigen::Index>(bytes.size()) / patch_size);
  for (Eigen::Index i = 0; i < atoms.size(); ++i)
    atoms.data()[i] =
        static_cast<float>(static_cast<signed char>(bytes[static_cast<std::size_t>(i)]));
  return from_atoms(atoms);
}

const Dictionary& Dictionary::shipped() {
  static const Dictionary dictionary = from_bytes(embedded::ms_srif_dictionary).value();
  return dictionary;
}

std::string quantised(const Eigen::MatrixXf& atoms) {
  std::string bytes;
  for (Eigen::Index i = 0; i < atoms.cols(); ++i) {
    const float largest = atoms.col(i).cwiseAbs().maxCoeff();
    for (Eigen::Index k = 0; k < atoms.rows(); ++k)
      bytes += static_cast<char>(std::lround(127 * atoms(k, i) / (largest > 0 ? largest : 1)));
  }
  return bytes;
}

}  // namespace orbitfuse::fusion

// A matrix that is costly to compute, kept in a file under everything it depends on.
#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <optional>
#include <vector>

namespace twin {

/// `key` holds all numbers the matrix depends on; they are written beside it and compared. Nothing if the file is
/// missing, truncated, corrupt or of another key.
std::optional<Eigen::MatrixXd> loadMatrix(const std::filesystem::path& directory, const std::vector<double>& key);

/// Creates the directory; replaces the file at once or not at all. False if it cannot.
bool saveMatrix(const std::filesystem::path& directory, const std::vector<double>& key, const Eigen::MatrixXd& matrix);

}  // namespace twin

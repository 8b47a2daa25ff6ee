// Stores a matrix that is costly to compute in a file that is named by everything that it depends on.
#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <optional>
#include <vector>

namespace sensor::elastic {

/// Reads the matrix of `key` from the directory. Returns nothing if its file is missing, truncated, corrupt, or has
/// more than 2^20 rows or columns.
/// \param key all numbers that the matrix depends on
std::optional<Eigen::MatrixXd> loadMatrix(const std::filesystem::path& directory, const std::vector<double>& key);

/// Writes the matrix of `key`; replaces an existing file atomically. Creates the directory. Returns false on
/// failure, without leaving a partial file. Old files are not deleted.
bool saveMatrix(const std::filesystem::path& directory, const std::vector<double>& key, const Eigen::MatrixXd& matrix);

}  // namespace sensor::elastic

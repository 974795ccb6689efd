// CSV files for tests, written from scratch.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace volto::test {

// A small OpenFace file. Each field may be changed before the text is made.
struct OpenFaceText {
  int rows = 3;
  int points = 68;
  bool with_3d = false;
  std::string separator = ", ";
  std::string newline = "\n";
  // Returns the cell for a row (0-based) and a column; the default text is given.
  std::function<std::string(int row, const std::string& column, const std::string& cell)> edit;

  std::string str() const {
    std::vector<std::string> columns{"frame", "face_id", "timestamp", "confidence", "success"};
    for (const char* axis : {"x_", "y_"}) {
      for (int i = 0; i < points; ++i) columns.push_back(axis + std::to_string(i));
    }
    if (with_3d) {
      for (const char* axis : {"X_", "Y_", "Z_"}) {
        for (int i = 0; i < points; ++i) columns.push_back(axis + std::to_string(i));
      }
    }
    std::string text = join(columns);
    for (int row = 0; row < rows; ++row) {
      std::vector<std::string> cells;
      for (const std::string& column : columns) {
        std::string cell = value(row, column);
        if (edit) cell = edit(row, column, cell);
        cells.push_back(cell);
      }
      text += join(cells);
    }
    return text;
  }

  // The value that point i has: 100 + i for x, 200 + 2 i for y, ten times as much for X, Y and 1000 for Z; half a pixel
  // more every row.
  static std::string value(int row, const std::string& column) {
    if (column == "frame") return std::to_string(row + 1);
    if (column == "face_id") return "0";
    if (column == "timestamp") return "0." + std::string(row < 10 ? "0" : "") + std::to_string(row);
    if (column == "confidence") return "0.98";
    if (column == "success") return "1";
    const double i = std::stod(column.substr(2));
    switch (column[0]) {
      case 'x':
        return std::to_string(100 + i + 0.5 * row);
      case 'y':
        return std::to_string(200 + 2 * i + 0.5 * row);
      case 'X':
        return std::to_string(1000 + 10 * i);
      case 'Y':
        return std::to_string(2000 + 20 * i);
      default:
        return "1000";
    }
  }

 private:
  std::string join(const std::vector<std::string>& cells) const {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) line += (i > 0 ? separator : "") + cells[i];
    return line + newline;
  }
};

}  // namespace volto::test

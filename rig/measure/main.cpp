// volto-measure-expression-table ICT_FOLDER FEATURE_POINTS.json > rig/assets/expression_table.csv
#include <exception>
#include <iostream>

#include "rig/measure/measure_expression_table.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: volto-measure-expression-table ICT_FOLDER FEATURE_POINTS.json\n";
    return 2;
  }
  try {
    std::cout << volto::rig::measureExpressionTable(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "volto-measure-expression-table: " << error.what() << '\n';
    return 65;
  }
}

// volto-make-take FOLDER: writes the shipped take, its truth and the manifest into FOLDER. Same program, same bytes.

#include <exception>
#include <iostream>

#include "recordings/make/shipped_take.h"

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::cerr << "usage: volto-make-take FOLDER\n";
    return 2;
  }
  try {
    volto::recordings::writeShippedTake(volto::recordings::makeShippedTake(), argv[1]);
  } catch (const std::exception& error) {
    std::cerr << "volto-make-take: " << error.what() << '\n';
    return 1;
  }
  return 0;
}

// volto-make-head DIR: writes volto_head.obj, volto_head.mtl and volto_head.points.json into DIR.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "rig/assets/head/head_mesh.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: volto-make-head DIR\n";
    return 2;
  }
  try {
    const std::filesystem::path directory = argv[1];
    const volto::head::Head head = volto::head::makeHead();
    const auto write = [&](const char* name, const std::string& text) {
      std::ofstream file(directory / name, std::ios::binary);
      file << text;
      if (!file.flush())
        throw std::runtime_error((directory / name).string() + ": cannot be written; check the folder");
    };
    write("volto_head.obj", volto::head::objText(head, "volto_head.mtl"));
    write("volto_head.mtl", volto::head::mtlText());
    write("volto_head.points.json", volto::head::pointsText(head));
    std::cout << head.vertices.size() << " vertices, " << head.polygons.size() << " polygons\n";
  } catch (const std::exception& error) {
    std::cerr << "volto-make-head: " << error.what() << '\n';
    return 1;
  }
  return 0;
}

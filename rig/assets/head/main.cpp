// volto-make-head DIR: writes the characters volto_head and volto_creature (.obj, .mtl, .points.json) into DIR.
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
    const auto write = [&](const std::string& name, const std::string& text) {
      std::ofstream file(directory / name, std::ios::binary);
      file << text;
      if (!file.flush())
        throw std::runtime_error((directory / name).string() + ": cannot be written; check the folder");
    };
    for (const volto::head::Character& character : {volto::head::adult(), volto::head::creature()}) {
      const volto::head::Head head = volto::head::makeHead(character);
      const std::string& name = character.file;
      write(name + ".obj", volto::head::objText(head, name + ".mtl"));
      write(name + ".mtl", volto::head::mtlText(character));
      write(name + ".points.json", volto::head::pointsText(head));
      std::cout << name << ": " << head.vertices.size() << " vertices, " << head.polygons.size() << " polygons\n";
    }
  } catch (const std::exception& error) {
    std::cerr << "volto-make-head: " << error.what() << '\n';
    return 1;
  }
  return 0;
}

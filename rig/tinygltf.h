// tinygltf as Volto uses it: types and JSON only. No image is ever decoded and no file ever opened by it; its code is
// compiled once, in tinygltf.cpp. Include this, never <tiny_gltf.h>.
#pragma once

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>

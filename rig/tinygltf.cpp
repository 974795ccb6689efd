// The one place where tinygltf's code is compiled.
#include <fstream>  // it uses them even without files
#include <sstream>

#define TINYGLTF_IMPLEMENTATION
#include "rig/tinygltf.h"

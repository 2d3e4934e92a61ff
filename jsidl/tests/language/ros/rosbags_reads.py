"""Reads the .msg files of packages with the package rosbags, which knows the rules of ROS 2; `.ci/ros2` runs it.

Usage: rosbags_reads.py DIRECTORY, the output of `jaus jsidl msg -o DIRECTORY`
"""

import pathlib
import sys

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

types = {}
files = sorted(pathlib.Path(sys.argv[1]).glob("*/msg/*.msg"))
for file in files:
    name = f"{file.parent.parent.name}/msg/{file.stem}"
    types |= get_types_from_msg(file.read_text(encoding="utf-8"), name)
assert 0 < len(types) == len(files), f"{len(files)} files have {len(types)} types"
store = get_typestore(Stores.ROS2_JAZZY)
store.register(types)
for name in types:
    # Each fails if a field has a type that does not exist.
    store.generate_msgdef(name, ros_version=2)
    store.hash_rihs01(name)
print(f"rosbags reads {len(types)} types")

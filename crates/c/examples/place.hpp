// Where an example runs: `SUBSYSTEM [GROUP]` for a node of its own on loopback, or `--attach ADDRESS` for
// the node of this host.
#ifndef EXAMPLE_PLACE_HPP
#define EXAMPLE_PLACE_HPP

#include <jaus.hpp>

#include <cstring>

inline jaus::Node place(int count, char **arguments, std::uint16_t subsystem) {
    if (count > 2 && std::strcmp(arguments[1], "--attach") == 0) {
        return jaus::Node::of_host(arguments[2]);
    }
    if (count > 1) {
        subsystem = static_cast<std::uint16_t>(std::stoi(arguments[1]));
    }
    jaus::Node node(subsystem, 1);
    node.loopback();
    if (count > 2) {
        node.group(arguments[2]);
    }
    node.start();
    return node;
}

#endif

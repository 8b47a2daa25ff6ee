// A network of one's own: GigE Vision's port is exclusive per address, so every test that opens a camera runs in a
// network namespace that holds nothing but a loopback.
#pragma once

namespace tractiond::test {

/// Call first in main(): starts the program again inside a fresh namespace, unless it only lists its tests.
/// Comes back where it is inside, or ends the program with a message.
void enterOwnNetwork(int argc, char** argv);

}  // namespace tractiond::test

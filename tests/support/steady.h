// Repeats tests of the timing of several threads if the machine itself stood still while they ran.
#pragma once

namespace tractiond::test {

/// Runs all Google tests. If one fails and the machine stood still for longer than a camera's packets can wait
/// meanwhile, the failure proves nothing: prints that, and executes the program again with the same arguments, up to
/// five times in all. Returns the exit code of the last run.
int runWhereTheMachineIsSteady(int argc, char** argv);

}  // namespace tractiond::test

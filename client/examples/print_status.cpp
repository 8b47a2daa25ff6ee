// Prints where the frames of a daemon went: print_status [ENDPOINT]

#include <traction/control.h>
#include <traction/v1/status.pb.h>

#include <cstdio>

int main(int argc, char** argv) {
  traction::ControlOptions options;
  if (argc > 1) options.endpoint = argv[1];
  try {
    const traction::Status status = traction::Control(options).status();
    const traction::v1::Ledger& ledger = status->ledger();
    std::printf("%llu received, %llu published, %llu stale\n", static_cast<unsigned long long>(ledger.received()),
                static_cast<unsigned long long>(ledger.published()), static_cast<unsigned long long>(ledger.stale()));
  } catch (const traction::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

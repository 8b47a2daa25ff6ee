#include "daemon/solve/stopping.h"

namespace tractiond::solve {

tl::unexpected<Error> givenUp() {
  return tl::unexpected(Error{.what = "given up, as the daemon stops"});
}

}  // namespace tractiond::solve

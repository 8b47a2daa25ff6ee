// Prints the resultant force of every field: print_resultant [ENDPOINT] [COUNT]

#include <traction/subscriber.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  traction::SubscriberOptions options;
  options.topics = traction::kField;
  if (argc > 1) options.endpoint = argv[1];
  const long count = argc > 2 ? std::strtol(argv[2], nullptr, 10) : -1;

  traction::Subscriber subscriber(options);
  for (long i = 0; i != count;) {
    const auto message = subscriber.receive(std::chrono::seconds(5));
    if (!message) {
      std::fprintf(stderr, "nothing from %s\n", subscriber.endpoint().c_str());
      return 1;
    }
    const auto& [x, y, z] = std::get<traction::Field>(*message).resultant_N;
    std::printf("%+.3f %+.3f %+.3f N\n", x, y, z);
    ++i;
  }
}

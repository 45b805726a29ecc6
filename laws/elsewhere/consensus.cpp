// Linear consensus for flockwire, in another process: u_i = h_i' - k sum_j w_ij ((p_i - p_j) - (h_i - h_j)).
//
//     g++ -O2 -o consensus consensus.cpp && ./consensus 5555     (or the path of a Unix socket)
//
// Each connection is the law of one drone. docs/law_elsewhere.md has the frames; needs a little-endian machine.
#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <vector>

using Numbers = std::vector<double>;

static bool read_all(int end, void *to, size_t size) {
  for (char *next = static_cast<char *>(to); size > 0;) {
    const ssize_t count = read(end, next, size);
    if (count <= 0) return false;
    next += count;
    size -= count;
  }
  return true;
}

static bool read_frame(int end, Numbers &frame) {
  uint32_t head[2];
  if (!read_all(end, head, sizeof head)) return false;
  frame.resize(head[0]);
  return read_all(end, frame.data(), 8 * frame.size());
}

static void write_frame(int end, const Numbers &frame) {
  std::vector<char> data(8 + 8 * frame.size());
  const uint32_t head[2] = {static_cast<uint32_t>(frame.size()), 0};
  memcpy(data.data(), head, 8);
  memcpy(data.data() + 8, frame.data(), 8 * frame.size());
  if (send(end, data.data(), data.size(), MSG_NOSIGNAL) < 0) return;  // the next read notices it
}

class Consensus {  // the law of one drone
 public:
  explicit Consensus(const Numbers &first) {
    const size_t count = static_cast<size_t>(first[7]);
    for (size_t j = 0; j < count; ++j) weights_.push_back(first[8 + count + j]);
    gain_ = first[9 + 3 * count];
  }

  Numbers step(const Numbers &seen) const {
    if (seen[1] == 0.0) return {seen[0], 0, 0, 0, NAN};  // not in formation: the pilot flies
    double pull[3] = {0, 0, 0};
    for (size_t j = 0; j < weights_.size(); ++j) {
      const double *one = &seen[10 + 7 * j];  // h_i - h_j, whether it is seen, p_j - p_i
      for (int axis = 0; one[3] != 0.0 && axis < 3; ++axis) pull[axis] += weights_[j] * (one[4 + axis] + one[axis]);
    }
    Numbers decision{seen[0]};
    for (int axis = 0; axis < 3; ++axis) decision.push_back(seen[7 + axis] + gain_ * pull[axis]);
    decision.push_back(std::sqrt(pull[0] * pull[0] + pull[1] * pull[1] + pull[2] * pull[2]));
    return decision;
  }

 private:
  std::vector<double> weights_;
  double gain_ = 0;
};

static int listen_at(const char *place) {
  const int port = atoi(place), yes = 1, end = socket(port ? AF_INET : AF_UNIX, SOCK_STREAM, 0);
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(port);
  here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  sockaddr_un path{};
  path.sun_family = AF_UNIX;
  strncpy(path.sun_path, place, sizeof path.sun_path - 1);
  setsockopt(end, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (!port) unlink(place);
  const bool bound = port ? bind(end, reinterpret_cast<sockaddr *>(&here), sizeof here) == 0
                          : bind(end, reinterpret_cast<sockaddr *>(&path), sizeof path) == 0;
  return bound && listen(end, 16) == 0 ? end : -1;
}

int main(int count, char **arguments) {
  const char *place = count > 1 ? arguments[1] : "5555";
  const int door = listen_at(place);
  if (door < 0) return perror(place), 1;
  printf("listens at %s\n", place);
  fflush(stdout);
  std::map<int, Consensus> laws;
  std::vector<pollfd> ends{{door, POLLIN, 0}};
  Numbers frame;
  while (poll(ends.data(), ends.size(), -1) > 0) {
    if (ends[0].revents) {
      const int end = accept(door, nullptr, nullptr), yes = 1;
      setsockopt(end, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      ends.push_back({end, POLLIN, 0});
    }
    for (size_t k = ends.size(); --k > 0;) {
      const int end = ends[k].fd;
      if (!ends[k].revents) continue;
      if (!read_frame(end, frame)) {
        close(end);
        laws.erase(end);
        ends.erase(ends.begin() + k);
      } else if (!laws.count(end)) {
        laws.emplace(end, Consensus(frame));
      } else {
        write_frame(end, laws.at(end).step(frame));
      }
    }
  }
}

% Linear consensus for flockwire, in another process: u_i = h_i' - k sum_j w_ij ((p_i - p_j) - (h_i - h_j)).
%
%     octave-cli consensus.m 5555        (Debian: octave, octave-sockets)
%
% Each connection is the law of one drone. docs/law_elsewhere.md has the frames; needs a little-endian machine.
% In MATLAB (R2021a or newer) tcpserver serves one connection, of a swarm with one follower.
pkg load sockets
1; % a script, not a function file

function data = take(from, size)
  data = uint8([]);
  while numel(data) < size
    more = recv(from, size - numel(data));
    if isempty(more)
      data = uint8([]);
      return
    end
    data = [data, more];
  end
end

function frame = read_frame(from)
  frame = [];
  head = take(from, 8);
  if ~isempty(head)
    frame = typecast(take(from, 8 * double(typecast(head(1:4), "uint32"))), "double");
  end
end

function write_frame(to, frame)
  send(to, [typecast(uint32([numel(frame), 0]), "uint8"), typecast(frame, "uint8")]);
end

function law = begin_law(first)
  count = first(8);
  law = struct("weights", first(9 + count : 8 + 2 * count), "gain", first(10 + 3 * count));
end

function decision = step_law(law, seen)
  decision = [seen(1), 0, 0, 0, NaN];
  if seen(2) == 0 % not in formation: the pilot flies
    return
  end
  pull = [0, 0, 0];
  for j = 1 : numel(law.weights)
    one = seen(4 + 7 * j : 10 + 7 * j); % h_i - h_j, whether it is seen, p_j - p_i
    if one(4) ~= 0
      pull += law.weights(j) * (one(5:7) + one(1:3));
    end
  end
  decision = [seen(1), seen(8:10) + law.gain * pull, norm(pull)];
end

port = str2double(argv(){end});
door = socket(AF_INET, SOCK_STREAM, 0);
setsockopt(door, SOL_SOCKET, SO_REUSEADDR, 1);
if bind(door, port) ~= 0 || listen(door, 16) ~= 0
  error("port %d cannot be served", port);
end
ends = [];
laws = {};
while true
  [~, ready] = select(max([door, ends]) + 1, [door, ends], [], [], 3600);
  for from = ready(:)'
    k = find(ends == from);
    if from == door
      ends(end + 1) = accept(door);
      laws{end + 1} = [];
      continue
    end
    frame = read_frame(from);
    if isempty(frame)
      disconnect(from);
      ends(k) = [];
      laws(k) = [];
    elseif isempty(laws{k})
      laws{k} = begin_law(frame);
    else
      write_frame(from, step_law(laws{k}, frame));
    end
  end
end

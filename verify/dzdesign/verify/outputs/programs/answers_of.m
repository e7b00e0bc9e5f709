% Answers of a function to codes: octave answers_of.m FUNCTION CODES ANSWERS. The first file has all commands, all pressures
% ahead and all behind, in 16 bits each; the second gets compare, status and beta alike.
1;
[name, asked, answers] = argv(){:};
warning('off', 'all');
from = fopen(asked);
codes = reshape(fread(from, Inf, 'uint16=>uint16', 0, 'ieee-le'), [], 3);
to = fopen(answers, 'w');
[compare, status, beta] = feval(name, codes(:, 1), codes(:, 2), codes(:, 3));
for found = {compare, status, beta}
  if ! isa(found{1}, 'uint16') || ! isequal(size(found{1}), [rows(codes), 1])
    error('%s gave a %s of size %s for %d codes', name, class(found{1}), mat2str(size(found{1})), rows(codes));
  end
  fwrite(to, found{1}, 'uint16', 0, 'ieee-le');
end
fclose(to);

% Answers of a function to codes: octave answers_of.m FUNCTION. Of each block of inputs standard input has their number, in
% 32 bits, then all commands, all pressures A and all pressures B, in 16 bits each. Standard output has compare, status and
% beta alike.
1;
name = argv(){1};
warning('off', 'all');
count = fread(stdin, 1, 'uint32=>double', 0, 'ieee-le');
while ! isempty(count)
  codes = fread(stdin, [count, 3], 'uint16=>uint16', 0, 'ieee-le');
  [compare, status, beta] = feval(name, codes(:, 1), codes(:, 2), codes(:, 3));
  for found = {compare, status, beta}
    if ! isa(found{1}, 'uint16') || ! isequal(size(found{1}), [count, 1])
      error('%s gave a %s of size %s for %d codes', name, class(found{1}), mat2str(size(found{1})), count);
    end
    fwrite(stdout, found{1}, 'uint16', 0, 'ieee-le');
  end
  fflush(stdout);
  count = fread(stdin, 1, 'uint32=>double', 0, 'ieee-le');
end

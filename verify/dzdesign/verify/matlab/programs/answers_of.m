% Answers of functions to codes in a file: octave answers_of.m OUTPUT CODES FIRST COUNT FUNCTION ANSWERS [FUNCTION ANSWERS ...]
% OUTPUT is the number of the output that is asked for. Codes are three numbers of 16 bits an input, answers one. A function
% that ends with an error, or gives another class or size, has the reason in ANSWERS.error in place of answers.
1;

function found = output_of(name, output, codes)
  u = codes(:, 1);
  a = codes(:, 2);
  b = codes(:, 3);
  switch output
    case 1
      found = feval(name, u, a, b);
    case 2
      [~, found] = feval(name, u, a, b);
    otherwise
      [~, ~, found] = feval(name, u, a, b);
  end
  if ! isa(found, 'uint16') || ! isequal(size(found), size(u))
    error('%s gave a %s of size %s for a column of %d codes', name, class(found), mat2str(size(found)), numel(u));
  end
end

function write_answers(name, output, codes_path, first, count, answers_path)
  held = 2 ^ 16;
  from = fopen(codes_path, 'rb');
  to = fopen(answers_path, 'wb');
  fseek(from, 6 * first, SEEK_SET);
  while count > 0
    codes = fread(from, [3, min(held, count)], 'uint16=>uint16', 0, 'ieee-le').';
    if isempty(codes)
      error('the codes end early');
    end
    fwrite(to, output_of(name, output, codes), 'uint16', 0, 'ieee-le');
    count = count - rows(codes);
  end
  fclose(from);
  fclose(to);
end

arguments = argv();
warning('off', 'all');
for place = 5 : 2 : numel(arguments)
  try
    write_answers(arguments{place}, str2double(arguments{1}), arguments{2}, str2double(arguments{3}), ...
                  str2double(arguments{4}), arguments{place + 1});
  catch fault
    reason = fopen([arguments{place + 1} '.error'], 'wb');
    fwrite(reason, fault.message);
    fclose(reason);
  end
end

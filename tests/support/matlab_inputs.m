% Classes, sizes and refusals of a function: octave inputs_of.m FUNCTION SCRIPT. Each line that is printed is one case, 1 or
% 0 for whether it is as described, and what it was. SCRIPT is parsed, and not run.
1;

function say(holds, text)
  printf('%d %s\n', holds, text);
end

function say_same(name, text, u, a, b)
  try
    [c, s, t] = feval(name, u, a, b);
    n = max([numel(u), numel(a), numel(b)]);
    if any([numel(u), numel(a), numel(b)] == 0)
      n = 0;
    end
    % One by one: an element is what its three codes give.
    holds = isa(c, 'uint16') && isa(s, 'uint16') && isa(t, 'uint16');
    holds = holds && isequal(size(c), size(s), size(t)) && numel(c) == n;
    for k = 1 : n * holds
      one = @(x) uint16(x(min(k, numel(x))));
      [c1, s1, t1] = feval(name, one(u), one(a), one(b));
      holds = holds && c1 == c(k) && s1 == s(k) && t1 == t(k);
    end
    for each = {u, a, b}
      holds = holds && (numel(each{1}) == 1 || isequal(size(c), size(each{1})));
    end
    say(holds, text);
  catch fault
    say(false, [text ': ' fault.message]);
  end
end

function say_refused(name, text, varargin)
  try
    feval(name, varargin{:});
    say(false, [text ' is taken']);
  catch fault
    say(numel(fault.message) > 20 && ! any(fault.message == "\n") && fault.message(end) == '.', [text ': ' fault.message]);
  end
end

name = argv(){1};
script = argv(){2};
warning('off', 'all');
codes = [0, 1, 2047, 2048, 4000, 4095, 4096, 65535];
for kind = {'uint16', 'uint32', 'uint64', 'int32', 'int64', 'single', 'double'}
  say_same(name, ['codes as ' kind{1}], feval(kind{1}, codes), feval(kind{1}, fliplr(codes)), feval(kind{1}, codes));
end
for kind = {'int8', 'uint8', 'int16'}
  small = feval(kind{1}, [0, 5, 100, 127]);
  say_same(name, ['codes as ' kind{1}], small, fliplr(small), small);
end
say_same(name, 'classes mixed', uint16(2000), 1500, int64(900));
say_same(name, 'a row', [10, 2000, 4000], [900, 1000, 1100], [800, 800, 800]);
say_same(name, 'a column', [10; 2000; 4000], [900; 1000; 1100], [800; 800; 800]);
say_same(name, 'a matrix', magic(4) * 200, magic(4)' * 200, magic(4) * 100);
say_same(name, 'three dimensions', reshape(0 : 170 : 4079, 2, 3, 4), reshape(4079 : -170 : 0, 2, 3, 4), 800);
say_same(name, 'a scalar command', 2000, [900; 1000; 1100], [800; 800; 800]);
say_same(name, 'scalar pressures', [0, 1000, 4095], 1500, 800);
say_same(name, 'one pressure a scalar', [0, 1000, 4095], [800, 900, 1000], 800);
say_same(name, 'pressure A alone an array', 2000, [900; 1000; 1100], 800);
say_same(name, 'pressure B alone an array', 2000, 1500, [700, 800, 900]);
say_same(name, 'nothing', [], [], []);
say_same(name, 'no rows', zeros(0, 3), 1500, 800);
say_same(name, 'no columns', zeros(3, 0, 'uint16'), zeros(3, 0), 800);
say_same(name, 'minus zero', -0, 1500, -0);
say_refused(name, 'NaN', NaN, 1500, 800);
say_refused(name, 'Inf', 2000, Inf, 800);
say_refused(name, '-Inf', 2000, 1500, -Inf);
say_refused(name, 'half a code', 2000.5, 1500, 800);
say_refused(name, 'a little less than a code', 2000, 1500, 800 - eps(800));
say_refused(name, '-1', -1, 1500, 800);
say_refused(name, '-1 as int16', 2000, int16(-1), 800);
say_refused(name, '65536', 2000, 1500, 65536);
say_refused(name, '65536 as int32', int32(65536), 1500, 800);
say_refused(name, '2^63 as uint64', 2000, bitshift(uint64(1), 63), 800);
say_refused(name, 'one wrong of many', [1, 2, 3, 70000], 1500, 800);
say_refused(name, 'a complex number', complex(2000, 0), 1500, 800);
say_refused(name, 'a sparse matrix', sparse(2000), 1500, 800);
say_refused(name, 'a text', 'a', 1500, 800);
say_refused(name, 'a logical', 2000, true, 800);
say_refused(name, 'a cell', 2000, 1500, {800});
say_refused(name, 'a structure', struct('u', 1), 1500, 800);
say_refused(name, 'a function', 2000, @sin, 800);
say_refused(name, 'a row and a column', [1, 2, 3], [1; 2; 3], 800);
say_refused(name, 'three and four', [1, 2, 3], [1, 2, 3, 4], 800);
say_refused(name, 'nothing beside three', [], [1, 2, 3], 800);
say_refused(name, 'two inputs', 2000, 1500);
say_refused(name, 'no input');
try
  say(nargin(script) == 1, [script ' parses']);
catch fault
  say(false, [script ': ' fault.message]);
end

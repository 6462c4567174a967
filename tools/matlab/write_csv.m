function write_csv(file, made_by, names, formats, data)
% One comment line that says how the file was made, one line of column names, then the numbers.
% formats: one for each column, or one for all.
if numel(formats) == 1
  formats = repmat(formats, 1, numel(names));
end
handle = fopen(file, 'w');
if handle < 0
  error('write_csv: cannot write %s', file);
end
fprintf(handle, '# %s\n', made_by);
joined = sprintf('%s,', names{:});
fprintf(handle, '%s\n', joined(1:end - 1));
joined = sprintf('%s,', formats{:});
fprintf(handle, [joined(1:end - 1), '\n'], data');
fclose(handle);
end

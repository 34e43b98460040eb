-- description: What samples refer to by number: stacks, their functions, and the files of these.
-- grain: one row, or none without samples
WITH file AS (SELECT id, file FROM perfetto_frame WHERE id = file_id)
SELECT {
    'mapping_paths': (SELECT list({'iid': id, 'str': encode(file)} ORDER BY id) FROM file),
    'mappings': (SELECT list({'iid': id, 'path_string_ids': [id]} ORDER BY id) FROM file),
    'function_names': list({'iid': id, 'str': encode(name)} ORDER BY id),
    'frames': list({'iid': id, 'function_name_id': id, 'mapping_id': file_id} ORDER BY id),
    'callstacks': (
        SELECT list({'iid': stack_id, 'frame_ids': frames} ORDER BY stack_id) FROM perfetto_stack
    )
} AS interned_data
FROM perfetto_frame
HAVING count(*) > 0

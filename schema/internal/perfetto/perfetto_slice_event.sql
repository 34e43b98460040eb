-- description: Slices as events of Perfetto. Arguments have the numbers of
--     `perfetto_interned_name`.
-- grain: one row per begin and end of a slice, and per moment
SELECT
    at_ns,
    {
        'track_uuid': track,
        'type': ['TYPE_SLICE_END', 'TYPE_SLICE_BEGIN', 'TYPE_INSTANT'][rank + 1],
        'name_iid': name,
        'category_iids': CASE WHEN rank > 0 THEN [code + 1] END,
        'debug_annotations': CASE WHEN rank > 0 THEN list_filter(
            [
                {'name_iid': code + 1, 'int_value': id, 'string_value_iid': NULL},
                {'name_iid': 9, 'int_value': NULL, 'string_value_iid': symbol_id},
                {'name_iid': 10, 'int_value': candidate_count, 'string_value_iid': NULL},
                {'name_iid': 11, 'int_value': queue_ns, 'string_value_iid': NULL},
                {'name_iid': 12, 'int_value': served_ns, 'string_value_iid': NULL}
            ],
            lambda note: coalesce(note.int_value, note.string_value_iid) IS NOT NULL
        ) END,
        'flow_ids': outgoing,
        'terminating_flow_ids': incoming
    } AS track_event
FROM (SELECT *, row_number() OVER () AS place FROM perfetto_slice)
ORDER BY place

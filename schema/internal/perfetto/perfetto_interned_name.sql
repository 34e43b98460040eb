-- description: What slices refer to by number: their names, what they are of, the names of their
--     arguments, and symbols of callbacks. An argument with the id of a thing has the code of it.
-- grain: one row
SELECT {
    'event_categories': list_transform(
        ['callback', 'publication', 'take', 'service', 'service', 'service', 'service', 'executor'],
        lambda name, place: {'iid': place, 'name': name}
    ),
    'event_names': (
        SELECT list({'iid': id * 8 + code + 1, 'name': name} ORDER BY code, id) FROM perfetto_name
    ),
    'debug_annotation_names': list_transform(
        [
            'callback_instance_id', 'publication_id', 'take_id', 'request_id', 'request_id',
            'response_id', 'response_id', 'executor_id', 'symbol', 'candidate_count', 'queue_ns',
            'served_ns'
        ],
        lambda name, place: {'iid': place, 'name': name}
    ),
    'debug_annotation_string_values': (
        SELECT list({'iid': id, 'str': encode(name)} ORDER BY id) FROM perfetto_symbol
    )
} AS interned_data

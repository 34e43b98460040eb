-- description: Publications that calls of services led to: of the services, and of clients that
--     got the response. Each has the callback instance that called first, and the message that this
--     instance was for, if any.
-- grain: one row per publication, callback instance that called for it, and way it did so
-- when: store.link_request

-- What a join looks up stays in memory until the query ends, and how often services were called is
-- hard to guess. So only callback instances that called, and publications of services, are looked
-- up.
CREATE OR REPLACE MACRO derive.flow_call(only_run) AS TABLE
WITH caller AS (
    SELECT i.callback_instance_id, i.take_id, t.subscription_id
    FROM store.callback_instance AS i
    SEMI JOIN derive.certain_request AS l ON i.callback_instance_id = l.callback_instance_id
    LEFT JOIN store.take AS t ON i.take_id = t.take_id
    WHERE i.run_id = only_run
),
published AS (
    SELECT
        l.run_id,
        derive.vertex_key('callback_instance', l.callback_instance_id) AS called_key,
        l.callback_instance_id,
        NULL::BIGINT AS taken_request_id,
        NULL::BIGINT AS taken_response_id,
        l.publication_id, l.publisher_id, l.kind
    FROM derive.certain_cause AS l
    SEMI JOIN (
        SELECT callback_instance_id
        FROM store.callback_instance
        WHERE run_id = only_run AND request_id IS NOT NULL
    ) AS i ON l.callback_instance_id = i.callback_instance_id
    WHERE l.run_id = only_run
    UNION ALL
    SELECT
        run_id,
        derive.vertex_key(from_kind, from_id),
        NULL, taken_request_id, taken_response_id, publication_id, publisher_id, 'take_adjacent'
    FROM derive.certain_call
    WHERE run_id = only_run AND publication_id IS NOT NULL
)
SELECT
    p.run_id, p.publication_id, p.publisher_id, p.kind, p.callback_instance_id,
    p.taken_request_id, p.taken_response_id, c.caller_id, c.route, i.take_id, i.subscription_id
FROM derive.flow_caller AS c
JOIN caller AS i ON c.caller_id = i.callback_instance_id
JOIN published AS p ON c.called_key = p.called_key
WHERE c.run_id = only_run

-- title: Publications to replay
-- description: What was published, by which callback instance, and when the middleware had it
--     (end_ns). Requests and responses are messages, too: their numbers and those of their
--     publishers are negative.
-- grain: one row per publication of a known publisher, request and response
-- param: begin_ns BIGINT  What begins earlier is left out
-- param: until_ns BIGINT  What begins later is left out
WITH cause AS (
    SELECT
        publication_id,
        min(callback_instance_id) AS callback_instance_id
    FROM main.link_causal
    WHERE run_id = $run_id AND kind = 'direct'
    GROUP BY publication_id
),
message AS (
    SELECT b.publication_id, b.publisher_id, b.start_ns, b.end_ns, c.callback_instance_id
    FROM main.publication AS b
    LEFT JOIN cause AS c ON b.publication_id = c.publication_id
    WHERE b.run_id = $run_id AND b.publisher_id IS NOT NULL
    UNION ALL
    SELECT
        -2 * q.request_id,
        -2 * q.client_id,
        q.sent_ns AS start_ns,
        q.sent_ns AS end_ns,
        l.callback_instance_id
    FROM main.request AS q
    LEFT JOIN main.link_request AS l ON q.request_id = l.request_id
    WHERE q.run_id = $run_id AND q.sent_ns IS NOT NULL
    UNION ALL
    SELECT
        -2 * p.response_id - 1,
        -2 * p.service_id - 1,
        p.sent_ns AS start_ns,
        p.sent_ns AS end_ns,
        i.callback_instance_id
    FROM main.response AS p
    LEFT JOIN main.callback_instance AS i
        ON p.request_id = i.request_id
        AND p.sent_ns BETWEEN i.start_ns AND i.end_ns
    WHERE p.run_id = $run_id AND p.sent_ns IS NOT NULL
)
SELECT publication_id, publisher_id, start_ns, end_ns, callback_instance_id
FROM message
WHERE start_ns BETWEEN $begin_ns AND $until_ns
ORDER BY start_ns, publication_id

-- title: A link leads to another run
-- description: Nothing is linked across runs: the ids of a run are one block.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run and table of links
-- severity: error
WITH publication AS (
    SELECT run_id, min(publication_id) AS first_id, max(publication_id) AS last_id
    FROM store.publication
    GROUP BY run_id
),
take AS (
    SELECT run_id, min(take_id) AS first_id, max(take_id) AS last_id
    FROM store.take
    GROUP BY run_id
),
callback_instance AS (
    SELECT run_id, min(callback_instance_id) AS first_id, max(callback_instance_id) AS last_id
    FROM store.callback_instance
    GROUP BY run_id
),
request AS (
    SELECT run_id, min(request_id) AS first_id, max(request_id) AS last_id
    FROM store.request
    GROUP BY run_id
),
response AS (
    SELECT run_id, min(response_id) AS first_id, max(response_id) AS last_id
    FROM store.response
    GROUP BY run_id
)
SELECT
    l.run_id,
    'link_transport' AS subject,
    count(*) AS count,
    'links to a row of another run' AS detail
FROM store.link_transport AS l
LEFT JOIN publication AS b ON l.run_id = b.run_id
LEFT JOIN take AS t ON l.run_id = t.run_id
WHERE coalesce(l.publication_id NOT BETWEEN b.first_id AND b.last_id, true)
    OR coalesce(l.take_id NOT BETWEEN t.first_id AND t.last_id, true)
GROUP BY l.run_id
UNION ALL
SELECT l.run_id, 'link_causal', count(*), 'links to a row of another run'
FROM store.link_causal AS l
LEFT JOIN publication AS b ON l.run_id = b.run_id
LEFT JOIN callback_instance AS i ON l.run_id = i.run_id
LEFT JOIN take AS t ON l.run_id = t.run_id
WHERE coalesce(l.publication_id NOT BETWEEN b.first_id AND b.last_id, true)
    OR coalesce(
        l.callback_instance_id NOT BETWEEN i.first_id AND i.last_id,
        l.callback_instance_id IS NOT NULL
    )
    OR coalesce(l.take_id NOT BETWEEN t.first_id AND t.last_id, l.take_id IS NOT NULL)
GROUP BY l.run_id
UNION ALL
SELECT m.run_id, 'bag_message', count(*), 'links to a row of another run'
FROM store.bag_message AS m
LEFT JOIN publication AS b ON m.run_id = b.run_id
WHERE coalesce(m.publication_id NOT BETWEEN b.first_id AND b.last_id, true)
GROUP BY m.run_id
UNION ALL
SELECT u.run_id, 'user_event', count(*), 'links to a row of another run'
FROM store.user_event AS u
LEFT JOIN callback_instance AS i ON u.run_id = i.run_id
WHERE coalesce(
    u.callback_instance_id NOT BETWEEN i.first_id AND i.last_id,
    u.callback_instance_id IS NOT NULL
)
GROUP BY u.run_id
UNION ALL
SELECT l.run_id, 'link_call', count(*), 'links to a row of another run'
FROM store.link_call AS l
LEFT JOIN publication AS b ON l.run_id = b.run_id
LEFT JOIN request AS q ON l.run_id = q.run_id
LEFT JOIN response AS r ON l.run_id = r.run_id
WHERE coalesce(l.publication_id NOT BETWEEN b.first_id AND b.last_id, l.publication_id IS NOT NULL)
    OR coalesce(
        least(l.taken_request_id, l.request_id) < q.first_id
        OR greatest(l.taken_request_id, l.request_id) > q.last_id,
        coalesce(l.taken_request_id, l.request_id) IS NOT NULL
    )
    OR coalesce(
        least(l.taken_response_id, l.response_id) < r.first_id
        OR greatest(l.taken_response_id, l.response_id) > r.last_id,
        coalesce(l.taken_response_id, l.response_id) IS NOT NULL
    )
GROUP BY l.run_id

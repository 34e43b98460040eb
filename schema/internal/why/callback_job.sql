-- title: Jobs that publish for callbacks
-- description: What a callback of Python has done on another thread, which publishes.
-- grain: one row per node, callback and topic
-- reads: callback_name
-- when: main.callback_instance WHERE continues_id IS NOT NULL
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers the callback that starts the job
-- column: topic_name VARCHAR  Topic on which the job publishes
-- column: job VARCHAR  Name of the job
SELECT
    n.node, n.callback, p.topic_name,
    mode(o.callback) AS job
FROM main.link_causal AS l
JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN callback_name AS n ON i.callback_id = n.callback_id
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
JOIN main.callback_instance AS j
    ON i.callback_instance_id = j.continues_id
    AND b.thread_id = j.thread_id
    AND b.start_ns BETWEEN j.start_ns AND coalesce(j.end_ns, b.start_ns)
JOIN callback_name AS o ON j.callback_id = o.callback_id
WHERE list_contains($runs, l.run_id) AND n.callback <> o.callback
GROUP BY n.node, n.callback, p.topic_name

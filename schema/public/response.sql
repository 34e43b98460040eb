-- name: main.response
-- description: Service responses.
-- grain: one row per service response
-- column: response_id BIGINT  Identity of the response
-- column: run_id BIGINT  Run that the row belongs to
-- column: client_id BIGINT  Client that took it
-- column: service_id BIGINT  Service that sent it
-- column: sequence_number BIGINT  Number given by the client
-- column: sent_ns BIGINT [epoch ns]  rmw_send_response
-- column: taken_ns BIGINT [epoch ns]  rmw_take_response
-- column: sender_thread_id BIGINT  Thread that sent it
-- column: receiver_thread_id BIGINT  Thread that took it
-- column: callback_instance_id BIGINT  Service callback it came from
-- column: request_id BIGINT  Request that it answers
-- needs: store.response, store.thread, derive.corrected_ns, derive.process_clock
SELECT
    self.response_id,
    self.run_id,
    self.client_id,
    self.service_id,
    self.sequence_number,
    derive.corrected_ns(self.sent_ns, s.offset_ns, s.drift_ppb, s.reference_ns) AS sent_ns,
    derive.corrected_ns(self.taken_ns, r.offset_ns, r.drift_ppb, r.reference_ns) AS taken_ns,
    self.sender_thread_id,
    self.receiver_thread_id,
    self.callback_instance_id,
    self.request_id
FROM store.response AS self
LEFT JOIN store.thread AS st ON self.sender_thread_id = st.thread_id
LEFT JOIN derive.process_clock AS s ON st.process_id = s.process_id
LEFT JOIN store.thread AS rt ON self.receiver_thread_id = rt.thread_id
LEFT JOIN derive.process_clock AS r ON rt.process_id = r.process_id

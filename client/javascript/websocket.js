// In Node, whose own WebSocket comes with version 22.
import {WebSocket} from "ws";

export default WebSocket;
